#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/linear/block_tree.hpp"

namespace linkwise::testing {
namespace {

constexpr Shape shapes[] = {Shape::chain, Shape::star, Shape::random_tree, Shape::bushy_tree};
constexpr Dims widths[] = {Dims::five, Dims::six, Dims::three, Dims::mixed};

TEST(BlockTree, ProductEqualsTheDenseOne) {
  for (Shape shape : shapes)
    for (Dims dims : widths)
      for (int n : {0, 1, 2, 3, 7, 8, 9, 40}) {
        SCOPED_TRACE(name_of(shape, dims, n));
        const BlockTree tree = random_tree(shape, dims, n, 17 + n);
        tree.check_consistency();
        const Dense dense = dense_twin(tree);
        const std::vector<double> x = random_vector(tree.size(), 3);
        std::vector<double> y(x.size(), std::nan(""));
        tree.multiply(x, y);
        const std::vector<double> expected = multiply(dense, x);
        double scale = 0.0;
        for (double value : expected) scale = std::max(scale, std::abs(value));
        for (std::size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(y[i], expected[i], 1e-13 * scale);
      }
}

TEST(BlockTree, LayoutOfAHub) {
  BlockTree tree;
  const std::vector<int> parents{-1, 0, 0, 1, 0, -1}, dims{0, 5, 6, 3, 5, 5};
  tree.set_structure(parents, dims);
  tree.check_consistency();
  EXPECT_EQ(tree.n(), 6);
  EXPECT_EQ(tree.size(), 24);
  ASSERT_EQ(tree.hubs.size(), 1u);
  EXPECT_EQ(tree.hubs[0].node, 0);
  EXPECT_EQ(tree.hubs[0].children, (std::vector<int>{1, 2, 4}));
  EXPECT_GE(tree.lever_of[4], 0);
  EXPECT_LT(tree.lever_of[3], 0);  // an only child
  EXPECT_LT(tree.lever_of[5], 0);  // the ground is not a hub
}

TEST(BlockTree, ConsistencyCheckNamesTheNode) {
  const BlockTree good = random_tree(Shape::bushy_tree, Dims::mixed, 9, 4);
  const auto complaint = [](const BlockTree& tree) -> std::string {
    try {
      tree.check_consistency();
    } catch (const std::logic_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(complaint(good), "");
  BlockTree bad = good;
  bad.parent[4] = 6;
  EXPECT_NE(complaint(bad).find("node 4"), std::string::npos);
  bad = random_tree(Shape::chain, Dims::five, 6, 4);
  bad.diag[3][1] += 1.0;
  EXPECT_NE(complaint(bad).find("node 3: diagonal block is not symmetric"), std::string::npos);
  bad = good;
  bad.hubs[0].children.pop_back();
  EXPECT_NE(complaint(bad).find("hub misses a child"), std::string::npos);
  bad = good;
  bad.lever_of[2] = -1;
  EXPECT_NE(complaint(bad).find("node 2: lever does not match"), std::string::npos);
}

}  // namespace
}  // namespace linkwise::testing
