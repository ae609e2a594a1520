// States off their loops are put back onto them with the least change.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "dynamics/looped_machine.hpp"
#include "linkwise/dynamics/loop_projection.hpp"
#include "linkwise/dynamics/quantities.hpp"

namespace linkwise::testing {
namespace {

/// A tree of hinges with a slide, a ball and a floating base, whose loops close at q.
LoopedMachine machine_with(JointType type, Draws& draws, bool again) {
  using enum JointType;
  LoopedMachine machine(tree_spec({floating, revolute, spherical, revolute, prismatic, revolute,
                                   revolute, universal, revolute},
                                  {-1, 0, 1, 2, 0, 4, 5, 6, -1}, draws),
                        draws);
  machine.close(type, 3, 7, draws);
  machine.close_rod(2, 8, draws);
  if (again) machine.close_again();
  return machine;
}

TEST(LoopProjection, ClosesLoopsWithTheLeastChangeOfRates) {
  Draws draws(11);
  using enum JointType;
  for (const JointType type :
       {revolute, prismatic, cylindrical, universal, spherical, planar, fixed})
    for (const bool again : {false, true}) {
      const LoopedMachine machine = machine_with(type, draws, again);
      LoopProjection loops(machine.model);
      std::vector<double> q = machine.q, v = machine.v, aside(v.size());
      for (double& x : aside) x = draws.uniform(-1e-3, 1e-3);
      move_by(machine.model, aside.data(), q.data());
      EXPECT_GT(loops.gap(q.data()), 1e-6);
      ASSERT_EQ(loops.project(q.data(), v.data()), Outcome::converged);
      EXPECT_LT(loops.gap(q.data()), 1e-13);
      EXPECT_LT(loops.slip(q.data(), v.data()), 1e-11);
      // What was taken away has no kinetic energy in common with what is left.
      std::vector<double> taken(v.size());
      for (size_t i = 0; i < v.size(); ++i) taken[i] = machine.v[i] - v[i];
      const double whole = kinetic_energy(machine.tree, q.data(), machine.v.data());
      EXPECT_NEAR(kinetic_energy(machine.tree, q.data(), v.data()) +
                      kinetic_energy(machine.tree, q.data(), taken.data()),
                  whole, 1e-9 * whole);
      const std::vector<double> q_before = q, v_before = v;
      ASSERT_EQ(loops.project(q.data(), v.data()), Outcome::converged);
      for (size_t i = 0; i < q.size(); ++i) EXPECT_NEAR(q[i], q_before[i], 1e-13);
      for (size_t i = 0; i < v.size(); ++i) EXPECT_NEAR(v[i], v_before[i], 1e-10);
    }
}

TEST(LoopProjection, KnowsWhatLoopsHoldAwayFromSingularPositions) {
  for (const int n : {1, 3, 30}) {
    const Model model(row_of_four_bars(n));
    LoopProjection loops(model);
    std::vector<double> q = model.neutral_configuration();
    loops.find_rank(q.data());
    EXPECT_EQ(loops.full_rank(), 2 * n);
    // All rods in one line.
    for (const JointInfo& joint : model.joints)
      q[joint.q] = (joint.name[0] == 'p' ? -1 : 1) * 0.5 * std::acos(-1.0);
    for (const JointInfo& joint : model.joints)
      if (joint.name[0] == 'l') q[joint.q] = 0.5 * std::acos(-1.0);
    EXPECT_LT(loops.gap(q.data()), 1e-12);
    LoopProjection here(model);
    std::vector<double> du(model.nv());
    here.gap(q.data());
    here.close(q.data(), 1e-12, du.data());
    EXPECT_EQ(here.report().rank, n);  // each loop holds one direction less
    EXPECT_EQ(loops.lost_at_start(), 0);
    loops.find_rank(q.data());
    if (n > 3) {
      EXPECT_GT(loops.lost_at_start(), 0);
      continue;
    }
    EXPECT_EQ(loops.full_rank(), 2 * n);
    EXPECT_EQ(loops.lost_at_start(), n);
  }
}

}  // namespace
}  // namespace linkwise::testing
