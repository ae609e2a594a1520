// Closed loops on machines with elastic links: the equations of motion by inverse dynamics of the
// open tree, and the loops' motion by finite differences.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "dynamics/looped_machine.hpp"
#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/dynamics/loop_projection.hpp"
#include "linkwise/dynamics/loop_rates.hpp"
#include "linkwise/model/flexible_link.hpp"

namespace linkwise::testing {
namespace {

/// base - boom, elastic, of two beams - stick - claw, elastic; base - arm, elastic - hand.
ModelSpec two_arms(bool floating) {
  ModelSpec spec;
  spec.floating_base = floating;
  spec.gravity = {0.3, -0.5, -9.81};
  spec.links.push_back({"base", 5, {0, 0.1, 0}, {{1, 0, 1.2, 0, 0, 0.9}}});
  const auto add = [&](const char* name, const char* parent, const Vec3<double>& at,
                       std::vector<AxisSpec> axes) {
    spec.links.push_back({name, 1.5, {0.1, 0, 0.1}, {{0.1, 0, 0.2, 0, 0, 0.15}}});
    JointSpec joint;
    joint.name = std::string("to_") + name;
    joint.type = axes.empty()       ? JointType::spherical
                 : axes.size() == 1 ? JointType::revolute
                                    : JointType::universal;
    joint.parent = parent;
    joint.child = name;
    joint.translation = at;
    joint.axes = std::move(axes);
    spec.joints.push_back(joint);
  };
  const Vec3<double> end{0.9, 0.2, 0.4};
  const AxisSpec x{AxisKind::revolute, {1, 0, 0}, 0}, y{AxisKind::revolute, {0, 0.6, 0.8}, 0};
  add("boom", "base", {}, {x, y});
  add("stick", "boom", end, {y});
  add("claw", "stick", {0.2, 0, 0.3}, {});
  add("arm", "base", {0.4, 0, 0}, {y});
  add("hand", "arm", end, {});
  for (const char* link : {"boom", "claw", "arm"}) {
    FlexibleLink flexible;
    flexible.link = link;
    flexible.E = 2e9;
    flexible.G = 8e8;
    flexible.area = 1e-3;
    flexible.Iy = 3e-7;
    flexible.Iz = 2e-7;
    flexible.J = 1e-7;
    flexible.bodies = link[0] == 'b' ? 2 : 1;
    flexible.interior_modes = 1;
    flexible.end = end;
    spec = with_flexible_link(spec, flexible);
  }
  return spec;
}

int body_of(const Model& model, const std::string& joint) {
  return model.joint_at(model.load_index(joint)).body;
}

/// Loops at ports, on frames of elastic links and on rigid bodies; of one group, or of several.
LoopedMachine closed(bool floating, int way) {
  Draws draws(50 + static_cast<std::uint64_t>(way) + (floating ? 10 : 0));
  LoopedMachine machine(two_arms(floating), draws);
  for (const Element& e : machine.tree.elements)
    for (int k = 0; e.kind == ElementKind::elastic && k < e.nq; ++k) machine.q[e.q + k] *= 0.02;
  const auto body = [&](const char* joint) { return body_of(machine.tree, joint); };
  const int base = floating ? body("root_joint") : -1;
  switch (way) {
    case 0:
      machine.close(JointType::fixed, body("boom:2"), body("arm:1"), draws);
      break;
    case 1:  // within one elastic link: its top is the link itself
      machine.close(JointType::spherical, body("to_boom"), body("boom:2"), draws);
      machine.close(JointType::revolute, body("claw:1"), body("to_hand"), draws);
      break;
    case 2:
      machine.close_rod(body("claw:1"), body("to_arm"), draws);
      machine.close_rod(base, body("to_claw"), draws);
      machine.close(JointType::planar, base, body("arm:1"), draws);
      machine.couple(2, draws, true);
      break;
    default:
      machine.close(JointType::universal, body("claw:1"), body("arm:1"), draws);
      machine.close_again();
      machine.add_rotors(draws);
  }
  machine.make_consistent();
  return machine;
}

class ElasticLoops : public ::testing::TestWithParam<std::pair<bool, int>> {
 protected:
  const LoopedMachine machine = closed(GetParam().first, GetParam().second);
  const Model& model = machine.model;
};

TEST_P(ElasticLoops, TakeTheForcesThatMoveThem) {
  const DynamicsCase c(machine.tree, 7);
  SweepInput<double> in = machine.input();
  in.tau = c.tau.data();
  in.external = c.external.data();
  std::vector<double> du(model.nv()), loads(6 * static_cast<size_t>(model.n_loads())), again = du;
  ArticulatedLoops kernel(model);
  ASSERT_TRUE(kernel.evaluate(in, du.data(), loads.data()));
  EXPECT_LT(kernel.report().contradiction, 1e-9);
  std::vector<double> external = c.external;
  double largest = 1;
  for (int l = 0; l < model.n_loops(); ++l) {
    const LoopJoint& loop = model.loops.joints[l];
    const Force<double> w = transpose_times(
        loop.joint.to_user, to_force(&loads[6 * (static_cast<size_t>(model.n_joints()) + l)]));
    machine.push(loop.joint.body, wrench_on_b(loop, w), external);
    machine.push(loop.parent_body, wrench_on_a(kernel.states()[l], w), external);
    for (const double x : to_array(w)) largest = std::max(largest, std::abs(x));
  }
  std::vector<double> tau(model.nv()), want(6 * static_cast<size_t>(model.n_joints()));
  in.external = external.data();
  InverseDynamics<double>(machine.tree).evaluate(in, du.data(), tau.data(), want.data());
  for (const double x : want) largest = std::max(largest, std::abs(x));
  std::vector<double> coupled;
  kernel.coupling_loads(in.q, coupled);
  size_t term = 0;
  for (const Coupling& coupling : model.couplings)
    for (const Coupling::Term& t : coupling.terms) tau[t.v] -= coupled[term++];
  for (int i = 0; i < model.nv(); ++i) EXPECT_NEAR(tau[i], c.tau[i], 1e-10 * largest) << i;
  for (size_t i = 0; i < want.size(); ++i) EXPECT_NEAR(loads[i], want[i], 1e-10 * largest) << i;
  in.external = c.external.data();
  ASSERT_TRUE(kernel.evaluate(in, again.data(), nullptr));
  for (int i = 0; i < model.nv(); ++i)
    EXPECT_NEAR(again[i], du[i], 1e-11 * (1 + std::abs(du[i]))) << i;
}

TEST_P(ElasticLoops, StayClosed) {
  constexpr double h = 1e-5;
  const DynamicsCase c(machine.tree, 7);
  SweepInput<double> in = machine.input();
  in.tau = c.tau.data();
  std::vector<double> du(model.nv());
  ArticulatedLoops kernel(model);
  ASSERT_TRUE(kernel.evaluate(in, du.data(), nullptr));
  double size = 1;
  for (const double x : du) size = std::max(size, std::abs(x));
  LoopStates states(model);
  std::vector<std::vector<double>> slips;
  for (const double step : {h, -h}) {
    std::vector<double> q = machine.q, v = machine.v, way(model.nv());
    for (int i = 0; i < model.nv(); ++i) {
      way[i] = step * (v[i] + 0.5 * step * du[i]);
      v[i] += step * du[i];
    }
    move_by(model, way.data(), q.data());
    SweepInput<double> there;
    there.q = q.data();
    there.v = v.data();
    states.update(there);
    slips.emplace_back();
    for (int l = 0; l < model.n_loops(); ++l)
      slips.back().insert(slips.back().end(), states[l].slip, states[l].slip + states[l].held);
  }
  for (size_t i = 0; i < slips[0].size(); ++i)
    EXPECT_NEAR((slips[0][i] - slips[1][i]) / (2 * h), 0, 1e-5 * size) << i;
}

TEST_P(ElasticLoops, AreClosedAgainByTheLeastEnergy) {
  std::vector<double> q = machine.q, v = machine.v, aside(model.nv());
  for (int i = 0; i < model.nv(); ++i) aside[i] = 1e-5 * std::cos(2.4 * i);
  move_by(model, aside.data(), q.data());
  for (int i = 0; i < model.nv(); ++i) v[i] += aside[i];
  LoopProjection loops(model);
  EXPECT_GT(loops.gap(q.data()), 1e-7);
  ASSERT_EQ(loops.project(q.data(), v.data(), true), Outcome::converged);
  EXPECT_LT(loops.gap(q.data()), 1e-13);
  EXPECT_LT(loops.slip(q.data(), v.data()), 1e-12);
  // Rates that went share no kinetic energy with those that stay.
  std::vector<double> before = machine.v, Hv(model.nv());
  for (int i = 0; i < model.nv(); ++i) before[i] += std::cos(2.4 * i);
  v = before;
  ASSERT_EQ(loops.project(q.data(), v.data(), true), Outcome::converged);
  SweepInput<double> rest;
  rest.q = q.data();
  rest.gravity_factor = 0;
  InverseDynamics<double>(machine.tree).evaluate(rest, v.data(), Hv.data(), nullptr);
  LoopRates(model).add_rotors(q.data(), v.data(), Hv.data());
  double shared = 0, all = 0;
  for (int i = 0; i < model.nv(); ++i) {
    shared += (v[i] - before[i]) * Hv[i];
    all += v[i] * Hv[i];
  }
  EXPECT_GT(all, 0);
  EXPECT_NEAR(shared, 0, 1e-10 * all);
}

INSTANTIATE_TEST_SUITE_P(Machines, ElasticLoops,
                         ::testing::Values(std::pair{false, 0}, std::pair{false, 1},
                                           std::pair{false, 2}, std::pair{false, 3},
                                           std::pair{true, 0}, std::pair{true, 1},
                                           std::pair{true, 2}, std::pair{true, 3}));

}  // namespace
}  // namespace linkwise::testing
