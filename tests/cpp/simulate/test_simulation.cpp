#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "integrate/closed_form_systems.hpp"
#include "kinematics/world_twin.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

/// Every kind of coordinate in one tree, no forces but gravity.
ModelSpec every_kind(std::uint64_t seed = 101) {
  Draws draws(seed);
  return tree_spec({revolute, spherical, planar, composite, revolute}, {-1, 0, 0, 1, 1}, draws);
}

/// A particle of 1 kg on a massless rod of 1 m: q'' = -9.81 sin q.
ModelSpec pendulum() {
  ModelSpec spec;
  spec.links = {{"base", 0, {}, {}}, {"bob", 1, {0, 0, -1}, {}}};
  JointSpec hinge;
  hinge.name = "hinge";
  hinge.parent = "base";
  hinge.child = "bob";
  hinge.axes = {{AxisKind::revolute, {0, 1, 0}, 0}};
  spec.joints = {hinge};
  return spec;
}

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
    const bool first_order = entry.kind == IntegratorKind::semi_implicit_euler;
    SimulationOptions options = fixed_step(first_order ? 1e-5 : 1e-3, entry.kind);
    options.integration.tolerance = 1e-9;
    Simulation simulation(make_model(pendulum()), options);
    const double zero = 0;
    simulation.start(0, &amplitude, &zero);
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
  const auto end_of = [&](double step) {
    Simulation simulation(model, fixed_step(step));
    simulation.start(0, state.q.data(), state.v.data());
    return run(simulation, {0.5}).at(0).q;
  };
  const std::vector<double> exact = end_of(0.5 / 4096);
  std::vector<double> steps, errors;
  for (double step : {0.5 / 64, 0.5 / 128, 0.5 / 256, 0.5 / 512}) {
    steps.push_back(step);
    errors.push_back(distance(end_of(step), exact));
  }
  EXPECT_NEAR(test::log_slope(steps, errors), 4, 0.15);
}

TEST(Conservation, EnergyOfAnUndrivenMachine) {
  ModelSpec spec = every_kind();
  spec.joints[0].dof = {{DofProperty::armature, {0.3}}, {DofProperty::stiffness, {20}}};
  spec.joints[2].dof = {{DofProperty::stiffness, {30}}, {DofProperty::rest_position, {0.1}}};
  const auto model = make_model(spec);
  Draws draws(103);
  const MachineState state = random_state(*model, draws);
  Simulation simulation(model, fixed_step(2.5e-4));
  simulation.start(0, state.q.data(), state.v.data());
  const auto at = run(simulation, every(0.1, 1));
  ASSERT_EQ(at.size(), 11u);
  for (const Instant& i : at) EXPECT_NEAR(i.energy(), at[0].energy(), 1e-7 * at[0].kinetic);
  EXPECT_GT(std::abs(at[10].potential - at[0].potential), 0.1);  // it did move
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
  simulation.start(0, &q, &v);
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
  Simulation simulation(model, fixed_step(2.5e-4));
  Drive torque;
  torque.kind = DriveKind::torque;
  torque.value = {1, -2, 3};
  simulation.set_drive(model->joint_index("joint1"), torque);
  simulation.start(0, state.q.data(), state.v.data());
  const auto at = run(simulation, {0, 1});
  ASSERT_EQ(at.size(), 2u);
  std::vector<double> before(6), after(6);
  momentum(*model, at[0].q.data(), at[0].v.data(), before.data());
  momentum(*model, at[1].q.data(), at[1].v.data(), after.data());
  EXPECT_LT(distance(before, after), 1e-8);
  EXPECT_GT(distance(at[0].v, at[1].v), 1e-2);
}

// ---- Locked joints ----------------------------------------------------------------------------

/// The machine with joint 1 replaced by a fixed joint at its position q.
ModelSpec welded_at(const ModelSpec& spec, const Model& model, const std::vector<double>& q) {
  const auto motions = WorldTwin(model).motions(q, std::vector<double>(model.nv()));
  const Pose<double>&parent = motions.pose[model.link_index(spec.joints[1].parent)],
        &child = motions.pose[model.link_index(spec.joints[1].child)];
  ModelSpec out = spec;
  out.keep_fixed = true;
  out.joints[1].type = fixed;
  out.joints[1].rotation = transpose(parent.R) * child.R;
  out.joints[1].translation = transpose_times(parent.R, child.p - parent.p);
  out.joints[1].dof.clear();
  return out;
}

TEST(Locked, EqualsTheMachineWithoutTheJoint) {
  for (JointType type : {revolute, universal, spherical, planar, composite})
    for (const char* method : {"articulated_body", "constraint_force", "composite_rigid_body"}) {
      SCOPED_TRACE(std::string(joint_type_name(type)) + " " + method);
      Draws draws(105);
      ModelSpec spec = tree_spec({revolute, type, revolute, prismatic}, {-1, 0, 1, 0}, draws);
      // What the joint does by itself must not show, but in the torque that holds it.
      if (type != spherical) spec.joints[1].dof = {{DofProperty::stiffness, {50}}};
      spec.joints[1].dof.push_back({DofProperty::armature, {0.4}});
      const auto model = make_model(spec);
      MachineState state = random_state(*model, draws);
      const JointInfo& locked = model->joints[1];
      for (int i = 0; i < locked.nv; ++i) state.v[locked.v + i] = 0;
      SimulationOptions options = fixed_step(1e-3);
      options.dynamics.method = method;
      Simulation simulation(model, options);
      Drive lock;
      lock.kind = DriveKind::locked;
      simulation.set_drive(1, lock);
      simulation.start(0, state.q.data(), state.v.data());

      const auto welded = make_model(welded_at(spec, *model, state.q));
      const auto without = [](std::vector<double> x, int from, int count) {
        x.erase(x.begin() + from, x.begin() + from + count);
        return x;
      };
      Simulation reference(welded, options);
      const auto q0 = without(state.q, locked.q, locked.nq);
      const auto v0 = without(state.v, locked.v, locked.nv);
      reference.start(0, q0.data(), v0.data());

      const auto got = run(simulation, every(0.1, 0.5)), want = run(reference, every(0.1, 0.5));
      ASSERT_EQ(got.size(), 6u);
      ASSERT_EQ(want.size(), 6u);
      for (int k = 0; k < 6; ++k) {
        EXPECT_LT(distance(without(got[k].q, locked.q, locked.nq), want[k].q), 1e-10);
        EXPECT_LT(distance(without(got[k].du, locked.v, locked.nv), want[k].du), 1e-8);
        EXPECT_LT(distance(got[k].loads, want[k].loads), 1e-8);
        const auto held = WorldTwin(*model).inverse_dynamics(got[k].q, got[k].v, got[k].du);
        for (int i = 0; i < locked.nv; ++i) {
          EXPECT_EQ(got[k].v[locked.v + i], 0);
          EXPECT_EQ(got[k].du[locked.v + i], 0);
          if (type == spherical || type == planar) continue;
          const double spring = -50 * got[k].q[locked.q + i];
          EXPECT_NEAR(got[k].drive_torque[locked.v + i], held.tau[locked.v + i] - spring, 1e-8);
        }
      }
    }
}

// ---- Wrenches ---------------------------------------------------------------------------------

/// A ball of 2 kg spinning about z at 3 rad/s, pushed with 4 N along x.
std::vector<Instant> push(bool world) {
  ModelSpec spec;
  spec.gravity = {};
  spec.floating_base = true;
  spec.links = {{"ball", 2, {}, {{0.1, 0, 0.1, 0, 0, 0.1}}}};
  Simulation simulation(make_model(spec), fixed_step(1e-3));
  Wrench wrench;
  wrench.world = world;
  wrench.value = {4, 0, 0, 0, 0, 0};
  simulation.add_wrench(wrench);
  const std::vector<double> q{0, 0, 0, 0, 0, 0, 1}, v{0, 0, 0, 0, 0, 3};
  simulation.start(0, q.data(), v.data());
  return run(simulation, {0.7});
}

TEST(Wrenches, InTheWorldKeepTheirDirection) {
  const auto at = push(true);
  ASSERT_EQ(at.size(), 1u);
  EXPECT_NEAR(at[0].q[0], 0.5 * 2 * 0.7 * 0.7, 1e-10);
  EXPECT_NEAR(at[0].q[1], 0, 1e-10);
}

TEST(Wrenches, InTheBodyTurnWithIt) {
  // x'' = 2 cos 3t, y'' = 2 sin 3t
  const auto at = push(false);
  ASSERT_EQ(at.size(), 1u);
  EXPECT_NEAR(at[0].q[0], 2 * (1 - std::cos(3 * 0.7)) / 9, 1e-10);
  EXPECT_NEAR(at[0].q[1], 2 * (3 * 0.7 - std::sin(3 * 0.7)) / 9, 1e-10);
}

TEST(Wrenches, AppearInTheJointLoads) {
  Draws draws(106);
  const auto model = make_model(every_kind());
  const MachineState state = random_state(*model, draws);
  Simulation simulation(model, fixed_step(1e-3));
  Wrench in_body, in_world;
  in_body.joint = 3;
  in_body.world = false;
  in_body.value = random_values(6, draws);
  in_world.joint = 1;
  in_world.value = random_values(6, draws);
  simulation.add_wrench(in_body);
  simulation.add_wrench(in_world);
  simulation.start(0, state.q.data(), state.v.data());
  const auto at = run(simulation, {0, 0.1});
  ASSERT_EQ(at.size(), 2u);
  const WorldTwin twin(*model);
  for (const Instant& i : at) {
    const auto pose = twin.motions(i.q, i.v).pose[model->joints[1].link];
    std::vector<double> external(6 * model->n_joints());
    for (int k = 0; k < 6; ++k) external[18 + k] = in_body.value[k];
    const auto& w = in_world.value;
    const Vec3<double> f = transpose_times(pose.R, Vec3<double>{w[0], w[1], w[2]});
    const Vec3<double> m = transpose_times(pose.R, Vec3<double>{w[3], w[4], w[5]});
    const double turned[6] = {f.x, f.y, f.z, m.x, m.y, m.z};
    for (int k = 0; k < 6; ++k) external[6 + k] = turned[k];
    const auto want = twin.inverse_dynamics(i.q, i.v, i.du, external);
    EXPECT_LT(distance(i.loads, want.loads), 1e-9);
    EXPECT_LT(distance(want.tau, std::vector<double>(model->nv())), 1e-9);
  }
}

// ---- Stops and errors -------------------------------------------------------------------------

std::vector<IntegratorKind> all_kinds() {
  std::vector<IntegratorKind> kinds;
  for (const IntegratorEntry& entry : integrator_registry()) kinds.push_back(entry.kind);
  return kinds;
}

// A torque or a wrench goes bad at t = 0.25: whatever the method, the integrator and the badness,
// the joint that it came in at is named although it spoils the accelerations of all.
TEST(Stops, NotFiniteNamesTheJointAndKeepsWhatCameBefore) {
  Draws draws(107);
  const auto model = make_model(tree_spec(std::vector(4, revolute), chain_parents(4), draws));
  const auto check = [&](Simulation& simulation, int joint) {
    const std::vector<double> zero(4);
    simulation.start(0, zero.data(), zero.data());
    EXPECT_EQ(run(simulation, every(0.1, 1)).size(), 3u);  // 0, 0.1, 0.2
    const Stop& stop = simulation.stop();
    EXPECT_FALSE(stop.ok());
    EXPECT_EQ(stop.outcome, "not_finite");
    EXPECT_EQ(stop.joint, joint);
    EXPECT_NEAR(stop.time, 0.25, 0.05);
    EXPECT_FALSE(stop.message.empty());
    Instant later;
    EXPECT_FALSE(advance(simulation, 2, later));
  };
  for (const IntegratorEntry& integrator : integrator_registry())
    for (const DynamicsEntry& method : dynamics_table())
      for (double bad : {std::numeric_limits<double>::quiet_NaN(), infinity}) {
        SCOPED_TRACE(std::string(integrator.name) + " " + std::string(method.name));
        SimulationOptions options = fixed_step(1e-3, integrator.kind);
        options.dynamics.method = method.name;
        Drive drive;
        drive.kind = DriveKind::torque_callable;
        drive.callable = [bad](double t, const double*, const double*, double* out) {
          *out = t > 0.25 ? bad : 0;
        };
        Simulation driven(model, options);
        driven.set_drive(2, drive);
        check(driven, 2);
        Wrench wrench;
        wrench.joint = 1;
        wrench.callable = [bad](double t, double* out) {
          std::fill(out, out + 6, t > 0.25 ? bad : 0);
        };
        Simulation pushed(model, options);
        pushed.add_wrench(wrench);
        check(pushed, 1);
      }
}

TEST(Stops, AStateThatBlowsUpIsNotFinite) {
  const auto model = make_model(pendulum());
  Simulation simulation(model, fixed_step(1e-3));
  Drive drive;
  drive.kind = DriveKind::torque_callable;
  drive.callable = [](double, const double*, const double* v, double* out) {
    *out = 1e3 * v[0] * v[0] * v[0];  // infinite speed within a finite time
  };
  simulation.set_drive(0, drive);
  const double q = 0, v = 1;
  simulation.start(0, &q, &v);
  const auto at = run(simulation, every(0.01, 10));
  EXPECT_LT(at.size(), 1000u);
  EXPECT_EQ(simulation.stop().outcome, "not_finite");
  EXPECT_EQ(simulation.stop().joint, 0);
  for (const Instant& i : at) EXPECT_TRUE(std::isfinite(i.q[0] + i.v[0]));
}

TEST(Stops, AStartThatIsNotFinite) {
  const auto model = make_model(pendulum());
  for (IntegratorKind kind : all_kinds()) {
    Simulation simulation(model, fixed_step(1e-3, kind));
    const double q = std::numeric_limits<double>::quiet_NaN(), v = 0;
    simulation.start(0, &q, &v);
    Instant at;
    EXPECT_FALSE(advance(simulation, 1, at));
    EXPECT_EQ(simulation.stop().outcome, "not_finite");
  }
}

TEST(Stops, ABodyThatNothingResistsIsNamed) {
  ModelSpec spec = pendulum();
  spec.links[1].com = {};
  Simulation simulation(make_model(spec), fixed_step(1e-3));
  const double zero = 0;
  simulation.start(0, &zero, &zero);
  EXPECT_EQ(run(simulation, {0, 1}).size(), 0u);
  EXPECT_EQ(simulation.stop().outcome, "not_positive_definite");
  EXPECT_EQ(simulation.stop().joint, 0);
}

std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Refused, EachWithOneLine) {
  Draws draws(108);
  ModelSpec spec = tree_spec({revolute, revolute, spherical}, chain_parents(3), draws);
  spec.source = "arm.urdf";
  make_massless(spec.links[1]);
  const auto model = make_model(spec);
  Simulation simulation(model, fixed_step(1e-3));
  Drive pd, lock;
  pd.kind = DriveKind::pd;
  pd.value = {0, 0, 0};
  EXPECT_EQ(error_of([&] { simulation.set_drive(2, pd); }),
            "joint 'joint2' of arm.urdf: a pd drive needs angles or distances, not a quaternion; "
            "drive it by torque");
  EXPECT_EQ(error_of([&] { simulation.add_wrench({}); }),
            "body 'link0' of arm.urdf has no mass, so no wrench can act on it; apply it to the "
            "next body outboard");
  std::vector<double> q = model->neutral_configuration(), v(5);
  q.back() = 0;
  EXPECT_EQ(error_of([&] { simulation.start(0, q.data(), v.data()); }),
            "joint 'joint2' of arm.urdf: its quaternion has zero length; give x, y, z, w of length "
            "1");
  q.back() = 1;
  lock.kind = DriveKind::locked;
  simulation.set_drive(1, lock);
  v[1] = 0.1;
  EXPECT_EQ(error_of([&] { simulation.start(0, q.data(), v.data()); }),
            "joint 'joint1' of arm.urdf is locked but starts with a rate; start it at rest");
  v[1] = 0;
  EXPECT_EQ(error_of([&] { simulation.start(0, q.data(), v.data()); }), "no error");
  EXPECT_NE(error_of([&] { Simulation(model, fixed_step(0)); }), "no error");
  SimulationOptions unknown = fixed_step(1e-3);
  unknown.dynamics.method = "magic";
  EXPECT_NE(error_of([&] { Simulation(model, unknown); }), "no error");
}

// ---- What is asked for does not change what happens --------------------------------------------

TEST(Output, ChangesNothing) {
  Draws draws(109);
  const auto model = make_model(every_kind());
  const MachineState state = random_state(*model, draws);
  for (IntegratorKind kind : all_kinds()) {
    SimulationOptions options = fixed_step(1e-3, kind);
    options.dynamics.method = "constraint_force";
    options.dynamics.solver = "conjugate_gradient";
    options.dynamics.initial_guess = "cubic";
    const auto end_of = [&](const std::vector<double>& times, bool everything) {
      Simulation simulation(model, options);
      simulation.start(0, state.q.data(), state.v.data());
      if (everything) return run(simulation, times).back().q;
      std::vector<double> q(model->nq());
      Sample only_q;
      only_q.position = q.data();
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
  for (IntegratorKind kind : all_kinds()) {
    Simulation simulation(model, fixed_step(1e-3, kind));
    simulation.start(0, state.q.data(), state.v.data());
    for (const Instant& at : run(simulation, {0, 0.05, 0.1234})) {
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
  simulation.start(0, state.q.data(), state.v.data());
  const auto first = run(simulation, {0, 0.1});
  const long steps = simulation.statistics().steps;
  simulation.start(0, state.q.data(), state.v.data());
  const auto second = run(simulation, {0, 0.1});
  EXPECT_EQ(first[1].q, second[1].q);
  EXPECT_EQ(first[1].loads, second[1].loads);
  EXPECT_EQ(steps, 100);
  EXPECT_EQ(simulation.statistics().steps, steps);
}

}  // namespace
}  // namespace linkwise::testing
