#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "integrate/closed_form_systems.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

// The pendulum's period is 2 pi sqrt(l / g) / agm(1, cos(amplitude / 2)).
TEST(Pendulum, SwingsWithItsPeriodInEveryIntegrator) {
  const double amplitude = 1.2;
  double a = 1, b = std::cos(amplitude / 2);
  for (int i = 0; i < 8; ++i) {
    const double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  const double period = 2 * std::numbers::pi / std::sqrt(9.81) / a;
  for (const IntegratorEntry& entry : integrator_registry()) {
    const bool first_order = entry.name == "semi_implicit_euler";
    SimulationOptions options = fixed_step(first_order ? 1e-5 : 1e-3, entry.name);
    options.integration.tolerance = 1e-9;
    Simulation simulation(make_model(pendulum()), options);
    const double zero = 0;
    simulation.start(0, {&amplitude, &zero});
    const auto at = run(simulation, {0, period / 2, period});
    ASSERT_EQ(at.size(), 3u) << entry.name;
    const double tolerance = first_order ? 1e-4 : 1e-7;
    EXPECT_NEAR(at[1].q[0], -amplitude, tolerance) << entry.name;
    EXPECT_NEAR(at[2].q[0], amplitude, tolerance) << entry.name;
    EXPECT_NEAR(at[2].v[0], 0, 10 * tolerance) << entry.name;
    EXPECT_NEAR(at[2].energy(), at[0].energy(), 10 * tolerance) << entry.name;
    EXPECT_NEAR(at[0].du[0], -9.81 * std::sin(amplitude), 1e-12) << entry.name;
  }
}

TEST(Order, RungeKuttaIsOfFourthOrderOnEveryKindOfJoint) {
  const auto model = make_model(every_kind());
  Draws draws(102);
  const MachineState state = random_state(*model, draws);
  const auto end_of = [&](double step, const Formulation& f) {
    Simulation simulation(model, with(fixed_step(step), f));
    simulation.start(0, {state.q.data(), state.v.data()});
    return run(simulation, {0.5}).at(0).q;
  };
  const std::vector<double> exact = end_of(0.5 / 4096, {"articulated_body"});
  for (const Formulation& f : formulations(*model)) {
    std::vector<double> steps, errors;
    for (double step : {0.5 / 64, 0.5 / 128, 0.5 / 256, 0.5 / 512}) {
      steps.push_back(step);
      errors.push_back(distance(end_of(step, f), exact));
    }
    EXPECT_NEAR(test::log_slope(steps, errors), 4, 0.15) << ::testing::PrintToString(f);
  }
}

TEST(Conservation, EnergyOfAnUndrivenMachine) {
  ModelSpec spec = every_kind();
  spec.joints[0].dof = {{DofProperty::armature, {0.3}}, {DofProperty::stiffness, {20}}};
  spec.joints[2].dof = {{DofProperty::stiffness, {30}}, {DofProperty::rest_position, {0.1}}};
  const auto model = make_model(spec);
  Draws draws(103);
  const MachineState state = random_state(*model, draws);
  for (const Formulation& f : formulations(*model)) {
    SCOPED_TRACE(::testing::PrintToString(f));
    Simulation simulation(model, with(fixed_step(2.5e-4), f));
    simulation.start(0, {state.q.data(), state.v.data()});
    const auto at = run(simulation, every(0.25, 1));
    ASSERT_EQ(at.size(), 5u);
    for (const Recorded& i : at) EXPECT_NEAR(i.energy(), at[0].energy(), 1e-7 * at[0].kinetic);
    EXPECT_GT(std::abs(at[4].potential - at[0].potential), 0.1);  // it did move
  }
}

// A slider hits its stop at x = 1 with 2 m/s: half a swing of mass and stop, pi sqrt(m / k) long,
// and it comes back as fast. The kink in the force costs the integrator its order.
TEST(Conservation, AnElasticStopGivesBackTheSpeed) {
  ModelSpec spec = pendulum();
  spec.gravity = {};
  spec.joints[0].type = prismatic;
  spec.joints[0].dof = {{DofProperty::upper, {1}}, {DofProperty::limit_stiffness, {400}}};
  Simulation simulation(make_model(spec), fixed_step(1e-4));
  const double q = 0, v = 2;
  simulation.start(0, {&q, &v});
  const double contact = std::numbers::pi / std::sqrt(400.0);
  const auto at = run(simulation, {0.5 + contact / 2, 1 + contact});
  ASSERT_EQ(at.size(), 2u);
  EXPECT_NEAR(at[0].q[0], 1 + 2 / std::sqrt(400.0), 1e-6);
  EXPECT_NEAR(at[0].potential, 0.5 * 2 * 2, 1e-6);
  EXPECT_NEAR(at[1].q[0], 0, 1e-6);
  EXPECT_NEAR(at[1].v[0], -2, 1e-6);
}

TEST(Conservation, MomentumOfAFreeMachineUnderInnerForces) {
  ModelSpec spec = every_kind();
  spec.floating_base = true;
  spec.gravity = {};
  spec.joints[4].dof = {{DofProperty::damping, {2}}};
  const auto model = make_model(spec);
  Draws draws(104);
  const MachineState state = random_state(*model, draws);
  Drive torque;
  torque.kind = DriveKind::torque;
  torque.value = {1, -2, 3};
  for (const Formulation& f : formulations(*model)) {
    SCOPED_TRACE(::testing::PrintToString(f));
    Simulation simulation(model, with(fixed_step(2.5e-4), f));
    simulation.set_drive(model->joint_index("joint1"), torque);
    simulation.start(0, {state.q.data(), state.v.data()});
    const auto at = run(simulation, {0, 1});
    ASSERT_EQ(at.size(), 2u);
    std::vector<double> before(6), after(6);
    momentum(*model, at[0].q.data(), at[0].v.data(), before.data());
    momentum(*model, at[1].q.data(), at[1].v.data(), after.data());
    EXPECT_LT(distance(before, after), 1e-8);
    EXPECT_GT(distance(at[0].v, at[1].v), 1e-2);
  }
}

TEST(Output, ChangesNothing) {
  Draws draws(109);
  const auto model = make_model(every_kind());
  const MachineState state = random_state(*model, draws);
  for (std::string_view kind : all_kinds()) {
    SimulationOptions options = fixed_step(1e-3, kind);
    options.dynamics.method = "constraint_force";
    options.dynamics.solver = "conjugate_gradient";
    options.dynamics.initial_guess = "cubic";
    const auto end_of = [&](const std::vector<double>& times, bool everything) {
      Simulation simulation(model, options);
      simulation.start(0, {state.q.data(), state.v.data()});
      if (everything) return run(simulation, times).back().q;
      std::vector<double> q(model->nq());
      Sample only_q;
      only_q["position"] = q.data();
      for (double t : times) EXPECT_TRUE(simulation.advance(t, only_q));
      return q;
    };
    const std::vector<double> reference = end_of({0.3}, false);
    EXPECT_EQ(end_of({0.3}, true), reference);
    EXPECT_EQ(end_of({0, 0.0123, 0.1, 0.25, 0.3}, true), reference);
  }
}

TEST(Output, QuaternionsAreOfUnitLengthWhateverTheStart) {
  Draws draws(110);
  const auto model = make_model(every_kind());
  const MachineState state = random_state(*model, draws);
  for (std::string_view kind : all_kinds()) {
    Simulation simulation(model, fixed_step(1e-3, kind));
    simulation.start(0, {state.q.data(), state.v.data()});
    for (const Recorded& at : run(simulation, {0, 0.05, 0.1234})) {
      const double* p = &at.q[model->joints[1].q];
      EXPECT_NEAR(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3], 1, 1e-14);
    }
  }
}

TEST(Output, RestartsAfresh) {
  Draws draws(111);
  const auto model = make_model(every_kind());
  const MachineState state = random_state(*model, draws);
  Simulation simulation(model, fixed_step(1e-3));
  simulation.start(0, {state.q.data(), state.v.data()});
  const auto first = run(simulation, {0, 0.1});
  const long steps = simulation.statistics().steps;
  simulation.start(0, {state.q.data(), state.v.data()});
  const auto second = run(simulation, {0, 0.1});
  EXPECT_EQ(first[1].q, second[1].q);
  EXPECT_EQ(first[1].loads, second[1].loads);
  EXPECT_EQ(steps, 100);
  EXPECT_EQ(simulation.statistics().steps, steps);
}

}  // namespace
}  // namespace linkwise::testing
