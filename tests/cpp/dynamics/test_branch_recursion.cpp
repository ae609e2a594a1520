#include <algorithm>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/dynamics/branch_recursion.hpp"

namespace linkwise::testing {
namespace {

DynamicsOptions with_threads(int threads) {
  DynamicsOptions options;
  options.threads = threads;
  return options;
}

TEST(BranchSchedule, FollowsTheTree) {
  Draws draws(61);
  //  0 - 1 - 2 -< 3 - 4
  //               5 -< 6, 7 - 8
  const Model model(
      tree_spec(std::vector(9, JointType::revolute), {-1, 0, 1, 2, 3, 2, 5, 5, 7}, draws));
  const BranchSchedule schedule(model);
  const std::vector<std::vector<int>> branches{{0, 1, 2}, {3, 4}, {5}, {6}, {7, 8}};
  EXPECT_EQ(schedule.branches, branches);
  const std::vector<std::vector<int>> outward{{0}, {1, 2}, {3, 4}}, inward{{4, 3, 1}, {2}, {0}};
  EXPECT_EQ(schedule.outward, outward);
  EXPECT_EQ(schedule.inward, inward);
}

TEST(BranchRecursion, GivesTheSameBitsForAnyNumberOfThreads) {
  for (const Machine& machine : all_machines()) {
    const Model model(machine.spec);
    const DynamicsCase c(model, 62);
    BranchRecursion one(model, with_threads(1));
    const Motion6 expected = evaluate(one, model, c.input());
    for (int threads : {2, 3, 7}) {
      BranchRecursion several(model, with_threads(threads));
      const Motion6 found = evaluate(several, model, c.input());
      EXPECT_EQ(found.du, expected.du) << machine.name;
      EXPECT_EQ(found.loads, expected.loads) << machine.name;
    }
  }
}

}  // namespace
}  // namespace linkwise::testing
