#include <set>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linkwise/linear/triplets.hpp"

namespace linkwise::testing {
namespace {

TEST(Triplets, MultiplyLikeTheTree) {
  for (const Shape shape : {Shape::chain, Shape::star, Shape::random_tree, Shape::bushy_tree}) {
    const BlockTree A = random_tree(shape, Dims::mixed, 23, 5);
    const Triplets entries = triplets_of(A);
    const std::vector<double> x = random_vector(A.size(), 6);
    std::vector<double> ours(x.size()), theirs(x.size());
    A.multiply(x, theirs);
    std::set<std::pair<int, int>> places;
    for (size_t k = 0; k < entries.value.size(); ++k) {
      ours[entries.row[k]] += entries.value[k] * x[entries.column[k]];
      EXPECT_TRUE(places.emplace(entries.row[k], entries.column[k]).second);
    }
    for (size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(ours[i], theirs[i], 1e-11);
  }
}

}  // namespace
}  // namespace linkwise::testing
