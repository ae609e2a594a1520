// The two-level preconditioner on the rigid chains of every kind, whose condition numbers reach
// 1e15.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linkwise/linear/residual.hpp"
#include "linkwise/linear/vector.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise::testing {
namespace {

double energy_distance(const BlockTree& tree, const std::vector<double>& x,
                       const std::vector<double>& y) {
  std::vector<double> e(x.size()), image(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) e[i] = x[i] - y[i];
  tree.multiply(e, image);
  const double top = std::max(0.0, dot(e, image));
  tree.multiply(y, image);
  return std::sqrt(top / dot(y, image));
}

class TwoLevelChains : public ::testing::TestWithParam<int> {};

TEST_P(TwoLevelChains, AtMostTwentyIterations) {
  for (const RodChain& chain : all_rod_chains(GetParam())) {
    SCOPED_TRACE(name_of(chain));
    const BlockTree tree = rod_chain(chain);
    const std::vector<double> b = random_vector(tree.size(), 5);
    SolverOptions refined, options;
    refined.set("refinement_steps", 4);
    refined.set("estimate_error", true);
    std::vector<double> reference(b.size()), x(b.size(), 0.0);
    const Report exact = make_solver("thomas", refined)->solve(tree, b, reference);
    options.tolerance = 1e-10;
    const Report report = make_solver("two_level", options)->solve(tree, b, x);
    EXPECT_LE(report.iterations, 20);
    EXPECT_LE(energy_distance(tree, x, reference), 1e-10 + 5 * exact.error_estimate);
    // Numbers of 53 bits cannot hold a solution to better than epsilon sqrt(condition): where that
    // is above the tolerance, the solver has to say so.
    if (exact.error_estimate < 0.5e-10) {
      EXPECT_TRUE(report.ok()) << to_string(report.outcome) << ' ' << report.error_estimate;
    } else if (exact.error_estimate > 2e-10) {
      EXPECT_EQ(report.outcome, Outcome::stagnated);
      EXPECT_LE(report.error_estimate, 5 * exact.error_estimate);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Lengths, TwoLevelChains, ::testing::Values(64, 256, 1000, 4096));

TEST(TwoLevel, IterationsDoNotGrowWithTheNumberOfPieces) {
  const RodChain short_chain{RodJoint::revolute_random, true, 128};
  const RodChain long_chain{RodJoint::revolute_random, true, 2048};
  const auto iterations = [](const RodChain& chain, int block_size) {
    const BlockTree tree = rod_chain(chain);
    std::vector<double> x(tree.size(), 0.0);
    SolverOptions options;
    options.set("block_size", block_size);
    return make_solver("two_level", options)
        ->solve(tree, random_vector(tree.size(), 5), x)
        .iterations;
  };
  for (int block_size : {16, 32, 64})
    EXPECT_LE(iterations(long_chain, block_size), iterations(short_chain, block_size) + 5);
}

}  // namespace
}  // namespace linkwise::testing
