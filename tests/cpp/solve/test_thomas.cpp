#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/solve/direct/thomas.hpp"

namespace linkwise::testing {
namespace {

SolverOptions with_error_estimate() {
  SolverOptions options;
  options.estimate_error = true;
  return options;
}

TEST(Thomas, ManyRightHandSidesEqualSingleSolves) {
  const BlockTree tree = random_tree(Shape::bushy_tree, Dims::mixed, 23, 5);
  const std::size_t size = tree.size();
  Thomas many({}), single({});
  const std::vector<double> b = random_vector(3 * tree.size(), 6);
  std::vector<double> x(b.size()), y(size);
  ASSERT_TRUE(many.solve_many(tree, 3, b, x).ok());
  for (std::size_t k = 0; k < 3; ++k) {
    const std::span<const double> bk = std::span(b).subspan(k * size, size);
    ASSERT_TRUE(single.solve(tree, bk, y).ok());
    for (std::size_t i = 0; i < size; ++i) EXPECT_EQ(x[k * size + i], y[i]);
  }
}

TEST(Thomas, AWrongInertiaIsNamed) {
  BlockTree tree = random_tree(Shape::chain, Dims::five, 12, 5);
  for (double& value : tree.diag[4]) value = -value;
  std::vector<double> x(tree.size());
  Thomas thomas({});
  const Report report = thomas.solve(tree, random_vector(tree.size(), 1), x);
  EXPECT_EQ(report.outcome, Outcome::not_positive_definite);
  EXPECT_EQ(report.node, 4);
}

TEST(Thomas, NotANumberIsNotIndefinite) {
  for (Shape shape : {Shape::chain, Shape::star}) {
    BlockTree tree = random_tree(shape, Dims::five, 12, 5);
    tree.diag[4][0] = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> x(tree.size()), b = random_vector(tree.size(), 1);
    Thomas thomas({});
    EXPECT_EQ(thomas.solve(tree, b, x).outcome, Outcome::not_finite);
    tree.diag[4][0] = 1e3;
    b[7] = std::numeric_limits<double>::infinity();
    EXPECT_EQ(thomas.solve(tree, b, x).outcome, Outcome::not_finite);
  }
}

// On the straight chain of parallel hinges, condition 1.7e10, elimination loses digits. The
// estimate must show that, to within a factor, and refinement must not make it worse.
TEST(Thomas, ErrorEstimateIsHonest) {
  for (const RodChain& chain : all_rod_chains(64)) {
    SCOPED_TRACE(name_of(chain));
    const BlockTree tree = rod_chain(chain);
    const Dense dense = dense_twin(tree);
    const std::vector<double> b = random_vector(tree.size(), 9);
    const std::vector<double> exact = cholesky_solve(dense, b);
    std::vector<double> x(tree.size());
    Thomas thomas(with_error_estimate());
    const Report report = thomas.solve(tree, b, x);
    ASSERT_TRUE(report.ok());
    const double error = energy_error(dense, x, exact);
    EXPECT_LT(error, 10 * report.error_estimate + 1e-15);
    EXPECT_GT(error, report.error_estimate / 10);
  }
}

TEST(Thomas, DeepTreesNeedNoStack) {
  const BlockTree tree = random_tree(Shape::chain, Dims::three, 200000, 2);
  const std::vector<double> exact = random_vector(tree.size(), 1);
  std::vector<double> b(exact.size()), x(exact.size());
  tree.multiply(exact, b);
  Thomas thomas({});
  ASSERT_TRUE(thomas.solve(tree, b, x).ok());
  for (std::size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(x[i], exact[i], 1e-7);
}

}  // namespace
}  // namespace linkwise::testing
