#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "kinematics/world_twin.hpp"
#include "linkwise/forces/passive.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {
namespace {

using enum DofProperty;

/// The machine with springs and stops on every angle and distance, and damping and friction
/// everywhere; stops so tight that most joints are beyond them.
ModelSpec with_forces(ModelSpec spec, Draws& draws, bool conservative) {
  for (JointSpec& j : spec.joints) {
    const int nv = joint_dof(j);
    const auto set = [&](DofProperty property, double low, double high) {
      std::vector<double> values(nv);
      for (double& x : values) x = draws.uniform(low, high);
      if (nv > 0) j.dof.push_back({property, values});
    };
    if (!conservative) {
      set(damping, 0, 2);
      set(friction, 0, 2);
      set(friction_velocity, 0.1, 1);
    }
    if (j.type == JointType::spherical || j.type == JointType::floating) continue;
    set(stiffness, 0, 5);
    set(rest_position, -1, 1);
    set(lower, -0.5, -0.2);
    set(upper, 0.2, 0.5);
    set(limit_stiffness, 1, 20);
    if (!conservative) set(limit_damping, 0, 3);
  }
  return spec;
}

class Passive : public ::testing::TestWithParam<Machine> {};

// The power of springs and stops is what their potential loses along the motion. Central
// differences are exact between the limits, where the potential is quadratic. The step is short,
// because a limit within it costs its stiffness times the step.
TEST_P(Passive, SpringsAndStopsGiveBackTheirPotential) {
  Draws draws(61);
  const Model model(with_forces(GetParam().spec, draws, true));
  const WorldTwin twin(model);
  for (int sample = 0; sample < 5; ++sample) {
    const MachineState state = random_state(model, draws);
    const std::vector<double> rate = twin.position_rate(state.q, state.v);
    std::vector<double> tau(model.nv());
    add_passive_forces(model, state.q.data(), state.v.data(), tau.data());
    double power = 0, scale = 1;
    for (int i = 0; i < model.nv(); ++i) {
      power += tau[i] * state.v[i];
      scale += std::abs(tau[i] * state.v[i]);
    }
    const auto potential = [&](double t) {
      std::vector<double> moved = state.q;
      for (size_t i = 0; i < moved.size(); ++i) moved[i] += t * rate[i];
      return passive_potential(model, moved.data());
    };
    constexpr double h = 1e-6;
    const double loss = -(potential(h) - potential(-h)) / (2 * h);
    EXPECT_NEAR(power, loss, 1e-7 * scale);
  }
}

TEST_P(Passive, DampingFrictionAndStopsNeverGivePower) {
  Draws draws(62);
  const Model model(with_forces(GetParam().spec, draws, false));
  const Model lossless(with_forces(GetParam().spec, draws, true));
  const auto power_at = [](const Model& m, const MachineState& s) {
    std::vector<double> tau(m.nv());
    add_passive_forces(m, s.q.data(), s.v.data(), tau.data());
    double power = 0;
    for (int i = 0; i < m.nv(); ++i) power += tau[i] * s.v[i];
    return power;
  };
  // With the potential's share taken out by running the same path backwards.
  for (int sample = 0; sample < 5; ++sample) {
    MachineState state = random_state(model, draws);
    const double forth = power_at(model, state);
    for (double& x : state.v) x = -x;
    EXPECT_LE(forth + power_at(model, state), 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, Passive, ::testing::ValuesIn(all_machines()),
                         [](const auto& test) { return test.param.name; });

struct Force {
  const char* name;
  std::vector<DofValue> properties;
  double q, v, want;
};

// One hinge, each law by hand.
TEST(PassiveLaws, ByHand) {
  const std::vector<DofValue> stops{
      {lower, {-1}}, {upper, {2}}, {limit_stiffness, {10}}, {limit_damping, {0.5}}};
  const Force cases[] = {
      {"nothing", {}, 1, 1, 0},
      {"damping", {{damping, {3}}}, 9, 2, -6},
      {"friction, fast", {{friction, {3}}}, 9, 2, -3},
      {"friction, slow", {{friction, {3}}, {friction_velocity, {2}}}, 0, -1, 3 * std::tanh(0.5)},
      {"spring", {{stiffness, {4}}, {rest_position, {0.5}}}, 2, 7, -6},
      {"within the stops", stops, 1.9, 5, 0},
      {"at rest beyond the upper stop", stops, 2.5, 0, -5},
      {"driven into the upper stop", stops, 2.5, 1, -7.5},
      {"coming back from the upper stop", stops, 2.5, -1, -2.5},
      {"coming back fast: a stop does not pull", stops, 2.5, -3, 0},
      {"driven into the lower stop", stops, -1.5, -1, 7.5},
      {"coming back fast from the lower stop", stops, -1.5, 4, 0},
      {"limits without stops", {{lower, {-1}}, {upper, {2}}}, 5, 1, 0},
  };
  Draws draws(63);
  for (const Force& c : cases)
    for (JointType type : {JointType::revolute, JointType::prismatic, JointType::helical}) {
      ModelSpec spec = tree_spec({type}, {-1}, draws);
      spec.joints[0].dof = c.properties;
      double tau = 100;
      add_passive_forces(Model(spec), &c.q, &c.v, &tau);
      EXPECT_DOUBLE_EQ(tau, 100 + c.want) << c.name;
    }
}

}  // namespace
}  // namespace linkwise::testing
