#include <cmath>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/linear/residual.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise::testing {
namespace {

// On the straight chain of parallel hinges, condition 6.5e7, elimination loses digits. The estimate
// must show that, to within a factor.
TEST(DirectSolvers, ErrorEstimateIsHonest) {
  for (const RodChain& chain : all_rod_chains(64)) {
    SCOPED_TRACE(name_of(chain));
    const BlockTree tree = rod_chain(chain);
    const Dense dense = dense_twin(tree);
    const std::vector<double> b = random_vector(tree.size(), 9);
    const std::vector<double> exact = cholesky_solve(dense, b);
    for (const char* name : {"thomas", "twisted", "cyclic_reduction"}) {
      SolverOptions options;
      options.set("estimate_error", true);
      std::vector<double> x(tree.size());
      const Report report = make_solver(name, options)->solve(tree, b, x);
      ASSERT_TRUE(report.ok());
      const double error = energy_error(dense, x, exact);
      EXPECT_LT(error, 5 * report.error_estimate) << name;
      EXPECT_GT(error, report.error_estimate / 5) << name;
    }
  }
}

// Refinement with an accurate residual leaves the rounding of the solution itself.
TEST(DirectSolvers, RefinementRecoversTheDigitsLost) {
  const BlockTree tree = rod_chain({RodJoint::revolute_parallel, true, 64});
  const Dense dense = dense_twin(tree);
  const std::vector<double> b = random_vector(tree.size(), 9);
  const std::vector<double> exact = cholesky_solve(dense, b);
  const auto error = [&](int steps) {
    SolverOptions options;
    options.set("refinement_steps", steps);
    std::vector<double> x(tree.size());
    EXPECT_TRUE(make_solver("thomas", options)->solve(tree, b, x).ok());
    return energy_error(dense, x, exact);
  };
  EXPECT_GT(error(0), 1e-10);
  EXPECT_LT(error(2), 1e-11);
}

TEST(DirectSolvers, AccurateResidualEqualsTheDenseOne) {
  for (Shape shape : {Shape::chain, Shape::star, Shape::bushy_tree}) {
    const BlockTree tree = random_tree(shape, Dims::mixed, 20, 3);
    const Dense dense = dense_twin(tree);
    const std::vector<double> x = random_vector(tree.size(), 1);
    // b equal to A x to all digits that it can hold: the residual is what rounding left of it.
    const std::vector<double> b = multiply(dense, x);
    std::vector<double> r(x.size());
    accurate_residual(tree, b, x, r);
    for (int i = 0; i < dense.size; ++i) {
      long double expected = b[i];
      for (int j = 0; j < dense.size; ++j)
        expected -= static_cast<long double>(dense.at(i, j)) * x[j];
      // The dense twin rounds the couplings through a hub; the residual does not.
      const double rounding = tree.hubs.empty() ? 1e-18 : 3e-15;
      EXPECT_NEAR(r[i], static_cast<double>(expected), rounding * (1 + std::abs(b[i])));
    }
  }
}

TEST(DirectSolvers, DeepTreesNeedNoStack) {
  const BlockTree tree = random_tree(Shape::chain, Dims::three, 200000, 2);
  const std::vector<double> exact = random_vector(tree.size(), 1);
  std::vector<double> b(exact.size()), x(exact.size());
  tree.multiply(exact, b);
  for (const char* name : {"thomas", "twisted", "cyclic_reduction"}) {
    ASSERT_TRUE(make_solver(name)->solve(tree, b, x).ok()) << name;
    double largest = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i)
      largest = std::max(largest, std::abs(x[i] - exact[i]));
    EXPECT_LT(largest, 1e-7) << name;
  }
}

TEST(DirectSolvers, AStarCostsNoCliques) {
  // The clique of 20000 siblings would hold 1e10 numbers.
  const BlockTree tree = random_tree(Shape::star, Dims::five, 20001, 2);
  const std::vector<double> exact = random_vector(tree.size(), 1);
  std::vector<double> b(exact.size()), x(exact.size());
  tree.multiply(exact, b);
  ASSERT_TRUE(make_solver("thomas")->solve(tree, b, x).ok());
  double largest = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) largest = std::max(largest, std::abs(x[i] - exact[i]));
  EXPECT_LT(largest, 1e-6);
}

}  // namespace
}  // namespace linkwise::testing
