// Threads share the tiles of an iteration's products and sums and change no bit of the result.

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linkwise/exec/tiles.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise::testing {
namespace {

class SolverThreads : public ::testing::TestWithParam<SolverEntry> {};

// Three tiles of nodes, several of entries; a few iterations will do.
TEST_P(SolverThreads, SameBits) {
  for (const Shape shape : {Shape::chain, Shape::random_tree}) {
    const BlockTree tree = random_tree(shape, Dims::five, 2500, 7);
    if (GetParam().chains_only && !tree.hubs.empty()) continue;
    const std::vector<double> b = random_vector(tree.size(), 8);
    const auto solve = [&](int threads) {
      SolverOptions options;
      options.max_iterations = 12;
      options.set("spectral_radius", 0.9);  // else found by hundreds of products
      options.executor = Executor(threads);
      std::vector<double> x(b.size(), 0.0);
      make_solver(GetParam().name, options)->solve(tree, b, x);
      return x;
    };
    const std::vector<double> one = solve(1);
    for (const int threads : {2, 3, 7}) EXPECT_EQ(solve(threads), one) << threads << " threads";
  }
}

INSTANTIATE_TEST_SUITE_P(Solvers, SolverThreads, ::testing::ValuesIn(solver_table()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(TileThreads, CoverEveryItemOnceWhateverTheLength) {
  for (const int n : {0, 1, 1023, 1024, 1025, 5000, 1024 * 256 + 1, 1 << 20}) {
    std::vector<int> met(n, 0);
    const Tiles tiles(n, TileOf::nodes);
    EXPECT_LE(tiles.count, max_tiles);
    const double sum = tiles.sum(Executor(3), [&](int begin, int end) {
      for (int i = begin; i < end; ++i) ++met[i];
      return static_cast<double>(end - begin);
    });
    EXPECT_EQ(sum, n);
    EXPECT_EQ(std::count(met.begin(), met.end(), 1), n);
  }
}

}  // namespace
}  // namespace linkwise::testing
