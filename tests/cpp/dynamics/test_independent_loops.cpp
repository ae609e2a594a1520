// Accelerations by independent rows of loops: which rows are taken, and that what is left out is
// looked at. That they are right, the equations of motion say in test_articulated_loops.cpp.
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "dynamics/looped_machine.hpp"
#include "linkwise/dynamics/articulated_loops.hpp"

namespace linkwise::testing {
namespace {

/// A row of four-bars, turned by an angle from upright and moving.
LoopedMachine turned_row(int n, double angle) {
  LoopedMachine machine(row_of_four_bars(n));
  for (int i = 0; i < machine.tree.nv(); ++i) {
    machine.q[i] = i % 2 == 0 ? angle : -angle;
    machine.v[i] = i % 2 == 0 ? 0.7 : -0.7;
  }
  return machine;
}

// Each hinge holds five directions, of which the plane leaves two. Where the rods lie flat these
// are dependent, and all rows are taken. Accelerations are those of an evaluation with loads, which
// takes all rows everywhere.
TEST(IndependentLoops, TwoRowsOfFiveHoldAPlanarLoop) {
  for (const int n : {1, 6, 40})
    for (const double from_flat : {1.0, 0.1, 1e-3, 0.0}) {
      SCOPED_TRACE(::testing::Message() << n << " four-bars, " << from_flat << " rad from flat");
      const LoopedMachine machine = turned_row(n, std::numbers::pi / 2 - from_flat);
      const std::vector<double> tau(machine.tree.nv());
      SweepInput<double> in = machine.input();
      in.tau = tau.data();
      std::vector<double> du(machine.tree.nv()), want(du), loads(6 * machine.model.n_loads());
      ArticulatedLoops kernel(machine.model);
      ASSERT_TRUE(kernel.evaluate(in, du.data(), nullptr));
      EXPECT_EQ(kernel.took_independent(), from_flat >= 0.1);
      const LoopReport report = kernel.report();
      ASSERT_TRUE(kernel.evaluate(in, want.data(), loads.data()));
      EXPECT_FALSE(kernel.took_independent());
      EXPECT_EQ(report.rows, kernel.report().rows);
      EXPECT_EQ(report.rank, kernel.report().rank);
      EXPECT_EQ(report.strong, kernel.report().strong);
      if (from_flat < 0.1) continue;
      EXPECT_EQ(report.rank, 2 * n);
      for (int i = 0; i < machine.tree.nv(); ++i) EXPECT_NEAR(du[i], want[i], 1e-10);
    }
}

// Of a joint that holds all six, any that is left out moves.
TEST(IndependentLoops, WhatIsLeftOutIsMissed) {
  using enum JointType;
  Draws draws(31);
  LoopedMachine machine(
      tree_spec({revolute, universal, spherical, prismatic, spherical, revolute, universal},
                {-1, 0, 1, 2, 3, 4, 5}, draws),
      draws);
  machine.close(fixed, -1, 6, draws);
  ASSERT_EQ(machine.make_consistent(), 6);
  const Model& model = machine.model;
  const std::vector<double> tau(model.nv());
  SweepInput<double> in = machine.input();
  in.tau = tau.data();
  ArticulatedLoops kernel(model);
  std::vector<double> want(model.nv());
  ASSERT_TRUE(kernel.evaluate(in, want.data(), nullptr));
  EXPECT_TRUE(kernel.took_independent());
  double size = 1;
  for (const double x : want) size = std::max(size, std::abs(x));

  const LoopMetric metric(model);
  const Motion<double> ground = ground_acceleration<double>(model, in.gravity_factor);
  const LoopStates& states = kernel.states();
  for (int left_out = -1; left_out < 6; ++left_out) {
    SCOPED_TRACE(left_out);
    std::vector<char> taken(6, 1);
    if (left_out >= 0) taken[left_out] = 0;
    IndependentLoops loops(model, kernel.groups(), {taken}, metric);
    TreeSweeps<double> sweeps(model);
    std::vector<double> du(model.nv());
    sweeps.start(false);
    sweeps.calc_velocities(in, model.kind_ranges);
    sweeps.eliminate_joints(in, model.kind_ranges, false);
    loops.carry(sweeps, in, states, 0);
    ASSERT_TRUE(loops.factor(0, 1e-9));
    loops.solve(sweeps, 0, ground);
    sweeps.accelerate_bodies(in, model.kind_ranges, du.data(), false);
    const double missed = loops.missed(sweeps, states, ground);
    if (left_out >= 0) {
      EXPECT_GT(missed, 1e-5);
      continue;
    }
    EXPECT_EQ(missed, 0);
    for (int i = 0; i < model.nv(); ++i) EXPECT_NEAR(du[i], want[i], 1e-9 * size);
  }
}

}  // namespace
}  // namespace linkwise::testing
