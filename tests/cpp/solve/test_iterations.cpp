// What theory says of the iterative schemes, checked on their iteration matrices: column j of the
// matrix is one iteration from the unit vector e_j minus one from zero.

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/solve/registry.hpp"
#include "linkwise/solve/spectrum.hpp"

namespace linkwise::testing {
namespace {

SolverOptions iterations(int count) {
  SolverOptions options;
  options.stop = StopRule::paper;
  options.tolerance = std::numeric_limits<double>::min();
  options.max_iterations = count;
  return options;
}

std::vector<double> iterate(const char* name, const BlockTree& tree, const std::vector<double>& b,
                            std::vector<double> x, const SolverOptions& options) {
  make_solver(name, options)->solve(tree, b, x);
  return x;
}

Dense iteration_matrix(const char* name, const BlockTree& tree, const SolverOptions& options) {
  Dense g;
  g.size = tree.size();
  g.a.assign(static_cast<std::size_t>(g.size) * g.size, 0.0);
  const std::vector<double> b = random_vector(g.size, 1);
  std::vector<double> x(g.size, 0.0);
  const std::vector<double> origin = iterate(name, tree, b, x, options);
  for (int j = 0; j < g.size; ++j) {
    x[j] = 1.0;
    const std::vector<double> y = iterate(name, tree, b, x, options);
    for (int i = 0; i < g.size; ++i) g.at(i, j) = y[i] - origin[i];
    x[j] = 0.0;
  }
  return g;
}

/// lim |G^k|^(1/k) by repeated squaring (Gelfand's formula).
double spectral_radius(Dense g) {
  const int n = g.size, squarings = 13;
  double logarithm = 0.0, power = 1.0;
  for (int k = 0; k < squarings; ++k) {
    double norm = 0.0;
    for (double value : g.a) norm += value * value;
    norm = std::sqrt(norm);
    for (double& value : g.a) value /= norm;
    logarithm += std::log(norm) / power;
    Dense square = g;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double sum = 0.0;
        for (int l = 0; l < n; ++l) sum += g.at(i, l) * g.at(l, j);
        square.at(i, j) = sum;
      }
    g = square;
    power *= 2.0;
  }
  return std::exp(logarithm);
}

std::vector<BlockTree> chains() {
  return {rod_chain({RodJoint::spherical, true, 8}),
          rod_chain({RodJoint::revolute_alternating, false, 7}),
          random_tree(Shape::chain, Dims::mixed, 9, 3)};
}

TEST(Iterations, GaussSeidelConvergesTwiceAsFastAsJacobi) {
  for (const BlockTree& tree : chains()) {
    const double jacobi = spectral_radius(iteration_matrix("jacobi", tree, iterations(1)));
    const double natural = spectral_radius(iteration_matrix("gauss_seidel", tree, iterations(1)));
    ASSERT_LT(jacobi, 1.0);
    ASSERT_GT(jacobi, 0.5);
    EXPECT_NEAR(std::log(natural) / std::log(jacobi), 2.0, 0.02);
    EXPECT_NEAR(estimate_spectrum(tree).radius(), jacobi, 2e-3);
  }
}

TEST(Iterations, RedBlackAndNaturalOrderHaveTheSameRate) {
  for (const BlockTree& tree : chains()) {
    const double natural = spectral_radius(iteration_matrix("gauss_seidel", tree, iterations(1)));
    const double red_black =
        spectral_radius(iteration_matrix("red_black_gauss_seidel", tree, iterations(1)));
    EXPECT_NEAR(std::log(red_black) / std::log(natural), 1.0, 0.01);
  }
}

TEST(Iterations, OptimalOverRelaxationHasRadiusOmegaMinusOne) {
  for (const BlockTree& tree : chains()) {
    const double mu = spectral_radius(iteration_matrix("jacobi", tree, iterations(1)));
    const double omega = 2.0 / (1.0 + std::sqrt(1.0 - mu * mu));
    SolverOptions options = iterations(1);
    for (const char* name : {"sor", "red_black_sor"}) {
      options.set("omega", omega);
      const double best = spectral_radius(iteration_matrix(name, tree, options));
      EXPECT_NEAR(best, omega - 1.0, 5e-3) << name;
      // Beyond the optimum every eigenvalue has the modulus omega - 1; before it the radius is
      // larger.
      const double beyond = 0.5 * (omega + 2.0);
      options.set("omega", beyond);
      EXPECT_NEAR(spectral_radius(iteration_matrix(name, tree, options)), beyond - 1.0, 5e-3);
      options.set("omega", 0.5 * (omega + 1.0));
      EXPECT_GT(spectral_radius(iteration_matrix(name, tree, options)), best);
    }
    EXPECT_NEAR(optimal_relaxation(estimate_spectrum(tree).smallest), omega, 5e-3);
  }
}

TEST(Iterations, AdaptiveOverRelaxationIsNearlyAsGoodAsOptimal) {
  for (const RodChain& chain : all_rod_chains(16)) {
    if (chain.joint == RodJoint::revolute_parallel) continue;
    SCOPED_TRACE(name_of(chain));
    const BlockTree tree = rod_chain(chain);
    const std::vector<double> b = random_vector(tree.size(), 4);
    const auto count = [&](const char* choice) {
      SolverOptions options;
      options.set("relaxation", choice);
      std::vector<double> x(b.size(), 0.0);
      const Report report = make_solver("sor", options)->solve(tree, b, x);
      EXPECT_TRUE(report.ok());
      return report.iterations;
    };
    EXPECT_LE(count("adaptive"), 2.5 * count("optimal"));
  }
}

TEST(Iterations, ChebyshevMeetsItsPolynomialBound) {
  for (const BlockTree& tree : chains()) {
    const Dense dense = dense_twin(tree);
    const std::vector<double> b = random_vector(tree.size(), 4), zero(b.size(), 0.0);
    const std::vector<double> exact = cholesky_solve(dense, b);
    const double mu = spectral_radius(iteration_matrix("jacobi", tree, iterations(1)));
    for (int k : {1, 2, 5, 10, 20, 40}) {
      SolverOptions options = iterations(k);
      options.set("spectral_radius", mu);
      const double error = energy_error(dense, iterate("chebyshev", tree, b, zero, options), exact);
      const double bound = 1.0 / std::cosh(k * std::acosh(1.0 / mu));
      EXPECT_LE(error, bound * (1.0 + 1e-3) + 1e-14) << k;
      EXPECT_GE(error, 1e-3 * bound) << k;
    }
  }
}

TEST(Iterations, BothFormsOfConjugateGradientsAreTheSame) {
  for (const BlockTree& tree : {random_tree(Shape::chain, Dims::five, 30, 3),
                                random_tree(Shape::bushy_tree, Dims::mixed, 30, 3),
                                rod_chain({RodJoint::revolute_alternating, true, 16})}) {
    const Dense dense = dense_twin(tree);
    const std::vector<double> b = random_vector(tree.size(), 4);
    const std::vector<double> start = random_vector(tree.size(), 5);
    for (int k : {1, 2, 3, 5, 10, 20}) {
      SolverOptions options = iterations(k);
      std::vector<double> two = start, three = start;
      const Report first = make_solver("conjugate_gradient", options)->solve(tree, b, two);
      options.set("form", "three_term");
      const Report second = make_solver("conjugate_gradient", options)->solve(tree, b, three);
      EXPECT_LT(energy_error(dense, three, two), 1e-10) << k;
      if (std::isfinite(first.error_estimate)) {
        EXPECT_NEAR(second.error_estimate / first.error_estimate, 1.0, 1e-6) << k;
      }
    }
    SolverOptions options;
    std::vector<double> x = start, y = start;
    const Report two = make_solver("conjugate_gradient", options)->solve(tree, b, x);
    options.set("form", "three_term");
    const Report three = make_solver("conjugate_gradient", options)->solve(tree, b, y);
    EXPECT_TRUE(two.ok() && three.ok());
    EXPECT_NEAR(two.iterations, three.iterations, 1);
  }
}

TEST(Iterations, ConjugateGradientsEndWithinTheDimension) {
  const BlockTree tree = random_tree(Shape::chain, Dims::three, 5, 3);
  const Dense dense = dense_twin(tree);
  const std::vector<double> b = random_vector(tree.size(), 4), zero(b.size(), 0.0);
  const std::vector<double> exact = cholesky_solve(dense, b);
  EXPECT_LT(
      energy_error(dense, iterate("conjugate_gradient", tree, b, zero, iterations(15)), exact),
      1e-12);
}

int cold_iterations(const char* name, const BlockTree& tree) {
  const std::vector<double> b = random_vector(tree.size(), 4);
  std::vector<double> x(b.size(), 0.0);
  const Report report = make_solver(name)->solve(tree, b, x);
  EXPECT_TRUE(report.ok()) << name;
  return report.iterations;
}

TEST(Iterations, ReducedSystemAndStairHalveTheIterations) {
  for (const RodChain& chain : all_rod_chains(32)) {
    SCOPED_TRACE(name_of(chain));
    const BlockTree tree = rod_chain(chain);
    const double plain = cold_iterations("conjugate_gradient", tree);
    EXPECT_NEAR(cold_iterations("rs_conjugate_gradient", tree) / plain, 0.5, 0.08);
    EXPECT_NEAR(cold_iterations("symmetric_stair_conjugate_gradient", tree) / plain, 0.5, 0.08);
    EXPECT_LT(cold_iterations("block_schwarz_conjugate_gradient", tree), 0.6 * plain);
  }
}

TEST(Iterations, LaggedFactorIsRenewedWhenItHasAged) {
  SolverOptions options;
  options.set("lag_limit", 5);
  const auto solver = make_solver("lagged_thomas", options);
  BlockTree tree = random_tree(Shape::bushy_tree, Dims::mixed, 40, 3);
  const std::vector<double> b = random_vector(tree.size(), 4);
  int renewals = 0, previous = 0, most = 0;
  for (int step = 0; step < 60; ++step) {
    // The diagonal drifts; the system stays positive definite.
    for (int i = 0; i < tree.n(); ++i)
      for (int k = 0; k < tree.dim[i]; ++k) tree.diag[i][7 * k] *= 1.0 + 0.004 * (1 + i % 3);
    std::vector<double> x(b.size(), 0.0);
    const Report report = solver->solve(tree, b, x);
    ASSERT_TRUE(report.ok());
    if (report.iterations < previous) ++renewals;
    previous = report.iterations;
    most = std::max(most, report.iterations);
  }
  EXPECT_GE(renewals, 2);
  EXPECT_LE(renewals, 20);
  EXPECT_LE(most, 8);
}

}  // namespace
}  // namespace linkwise::testing
