#include <cmath>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/solve/checked_solver.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise::testing {
namespace {

// Without motion the error is computed, not bounded from above: the report has it exactly.
TEST(CheckedSolver, ReportsTheErrorItself) {
  for (const RodChain& chain : all_rod_chains(24)) {
    const BlockTree tree = rod_chain(chain);
    const Dense dense = dense_twin(tree);
    const std::vector<double> b = random_vector(tree.size(), 11);
    const std::vector<double> exact = cholesky_solve(dense, b);
    for (const char* name : {"conjugate_gradient", "rs_conjugate_gradient", "two_level"})
      for (StopRule rule : {StopRule::energy_norm, StopRule::residual, StopRule::paper}) {
        SCOPED_TRACE(std::string(name_of(chain)) + ' ' + name);
        SolverOptions options;
        options.tolerance = 1e-3;
        options.stop = rule;
        std::vector<double> x(b.size(), 0.0);
        const Report report = CheckedSolver(name, options, false).solve(tree, b, x);
        ASSERT_TRUE(report.ok());
        EXPECT_TRUE(report.error_is_bound);
        const double error = energy_error(dense, x, exact);
        EXPECT_NEAR(error, report.error_estimate, 1e-3 * error + 1e-9);
        if (rule == StopRule::energy_norm) EXPECT_LE(error, 1e-2);
      }
  }
}

TEST(CheckedSolver, GoesOnWhereTheMotionIsNotGoodEnough) {
  const BlockTree tree = rod_chain({RodJoint::revolute_random, true, 24});
  const std::vector<double> b = random_vector(tree.size(), 11);
  SolverOptions options;
  options.tolerance = 1e-3;
  std::vector<double> x(b.size(), 0.0), y = x;
  const Report plain = CheckedSolver("conjugate_gradient", options, false).solve(tree, b, x);
  int rounds = 0;
  // The motion's error is a hundred tolerances at first and falls with each round.
  const Report more =
      CheckedSolver("conjugate_gradient", options, false).solve(tree, b, y, [&](bool) {
        return MotionError{1e2 * std::pow(0.1, rounds++ / 2), 1e3};
      });
  EXPECT_TRUE(more.ok());
  EXPECT_GT(rounds, 2);
  EXPECT_GT(more.iterations, plain.iterations);
}

TEST(CheckedSolver, LearnsOnlyWhereItMay) {
  const BlockTree tree = rod_chain({RodJoint::revolute_random, true, 24});
  const std::vector<double> b = random_vector(tree.size(), 11);
  SolverOptions options;
  options.tolerance = 1e-3;
  for (bool learns : {false, true}) {
    CheckedSolver solver("conjugate_gradient", options, learns);
    int asked = 0;
    const auto once = [&](bool) { return MotionError{asked++ < 2 ? 1e6 : 0.0, 1e3}; };
    std::vector<double> x(b.size(), 0.0), again = x;
    solver.solve(tree, b, x, once);
    const int first = solver.solve(tree, b, again, once).iterations;
    std::vector<double> plain(b.size(), 0.0);
    const int without =
        make_solver("conjugate_gradient", options)->solve(tree, b, plain).iterations;
    EXPECT_EQ(first > without, learns);
  }
}

TEST(CheckedSolver, LeavesDirectSolversAlone) {
  const BlockTree tree = random_tree(Shape::chain, Dims::five, 9, 3);
  const std::vector<double> b = random_vector(tree.size(), 1);
  std::vector<double> x(b.size(), 0.0), y = x;
  CheckedSolver checked("twisted", {}, true);
  EXPECT_TRUE(checked.is_direct());
  EXPECT_TRUE(checked.solve(tree, b, x).ok());
  make_solver("twisted")->solve(tree, b, y);
  EXPECT_EQ(x, y);
}

}  // namespace
}  // namespace linkwise::testing
