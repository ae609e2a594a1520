// The contract of every entry of the solver table, on every shape of tree, joint dimension and
// awkward size, against dense Cholesky in long double.

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/linear/vector.hpp"
#include "linkwise/solve/registry.hpp"
#include "linkwise/solve/spectrum.hpp"

namespace linkwise::testing {
namespace {

constexpr Shape shapes[] = {Shape::chain, Shape::star, Shape::random_tree, Shape::bushy_tree};
constexpr Dims widths[] = {Dims::five, Dims::six, Dims::three, Dims::mixed};

class EverySolver : public ::testing::TestWithParam<SolverEntry> {
 protected:
  const SolverEntry& entry() const { return GetParam(); }
  bool takes(const BlockTree& tree) const { return !entry().chains_only || tree.hubs.empty(); }
  /// The basic iterations need about condition * log(1 / tolerance) steps.
  bool may_run_out(const BlockTree& tree) const {
    const bool basic = entry().name == "jacobi" || entry().name == "gauss_seidel" ||
                       entry().name == "red_black_gauss_seidel";
    return basic && estimate_spectrum(tree).condition() > 500.0;
  }
  /// Jacobi alone may diverge, and only where its spectral radius says so.
  bool may_diverge(const BlockTree& tree) const {
    return entry().name == "jacobi" && estimate_spectrum(tree).radius() >= 1.0;
  }
};

double tree_energy_error(const BlockTree& tree, const std::vector<double>& x,
                         const std::vector<double>& exact) {
  std::vector<double> e(x.size()), ae(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) e[i] = x[i] - exact[i];
  tree.multiply(e, ae);
  const double top = dot(e, ae);
  tree.multiply(exact, ae);
  return std::sqrt(top / dot(exact, ae));
}

TEST_P(EverySolver, SolvesToItsTolerance) {
  for (Shape shape : shapes)
    for (Dims dims : widths)
      for (int n : {1, 2, 3, 7, 8, 9, 33}) {
        const BlockTree tree = random_tree(shape, dims, n, 100 + n);
        if (tree.size() == 0 || !takes(tree)) continue;
        SCOPED_TRACE(name_of(shape, dims, n));
        const Dense dense = dense_twin(tree);
        const std::vector<double> b = random_vector(tree.size(), 7);
        const std::vector<double> exact = cholesky_solve(dense, b);
        ASSERT_FALSE(exact.empty());
        for (double tolerance : {1e-4, 1e-10}) {
          SolverOptions options;
          options.tolerance = tolerance;
          options.set("estimate_error", true);
          const auto solver = entry().make(options);
          std::vector<double> x(b.size(), 0.0);
          const Report report = solver->solve(tree, b, x);
          if (report.outcome == Outcome::diverged && may_diverge(tree)) continue;
          if (report.outcome == Outcome::reached_max_iterations && may_run_out(tree)) continue;
          ASSERT_TRUE(report.ok()) << to_string(report.outcome);
          const double error = energy_error(dense, x, exact);
          EXPECT_LE(error, 3.0 * tolerance) << report.iterations << " iterations";
          EXPECT_LE(error, 4.0 * report.error_estimate + 1e-12);
          EXPECT_LE(report.error_estimate, 1.0001 * tolerance);
        }
      }
}

TEST_P(EverySolver, SolvesAThousandNodes) {
  for (Shape shape : shapes) {
    const BlockTree tree = random_tree(shape, Dims::mixed, 1000, 5);
    if (!takes(tree)) continue;
    SCOPED_TRACE(name_of(shape, Dims::mixed, 1000));
    const std::vector<double> exact = random_vector(tree.size(), 8);
    std::vector<double> b(exact.size()), x(exact.size(), 0.0);
    tree.multiply(exact, b);
    SolverOptions options;
    options.tolerance = 1e-6;
    const Report report = entry().make(options)->solve(tree, b, x);
    // A star of a thousand joints has a spectral radius near 1000.
    if (report.outcome == Outcome::diverged && may_diverge(tree)) continue;
    if (report.outcome == Outcome::reached_max_iterations && may_run_out(tree)) continue;
    ASSERT_TRUE(report.ok()) << to_string(report.outcome);
    EXPECT_LE(tree_energy_error(tree, x, exact), 3e-6);
  }
}

TEST_P(EverySolver, EmptySystemsAndZeroRightHandSides) {
  const auto solver = entry().make({});
  BlockTree nothing;
  nothing.set_structure({}, {});
  std::vector<double> none;
  EXPECT_TRUE(solver->solve(nothing, none, none).ok());

  BlockTree free_base;  // a floating base alone: a node without rows
  const std::vector<int> parents{-1}, dims{0};
  free_base.set_structure(parents, dims);
  EXPECT_TRUE(solver->solve(free_base, none, none).ok());

  const BlockTree tree = random_tree(Shape::chain, Dims::five, 7, 1);
  const std::vector<double> b(tree.size(), 0.0);
  std::vector<double> x(tree.size(), 3.0);
  EXPECT_TRUE(solver->solve(tree, b, x).ok());
  for (double value : x) EXPECT_EQ(value, 0.0);
}

TEST_P(EverySolver, IsDeterministicAndKeepsNoTraceOfOtherSystems) {
  const BlockTree tree = random_tree(Shape::chain, Dims::mixed, 33, 3);
  const BlockTree other = random_tree(Shape::chain, Dims::five, 20, 4);
  const std::vector<double> b = random_vector(tree.size(), 1);
  std::vector<double> x(b.size(), 0.0), again(b.size(), 0.0);
  std::vector<double> y(other.size(), 0.0);
  const auto solver = entry().make({});
  ASSERT_TRUE(solver->solve(tree, b, x).ok());
  ASSERT_TRUE(solver->solve(other, random_vector(other.size(), 2), y).ok());
  ASSERT_TRUE(solver->solve(tree, b, again).ok());
  EXPECT_EQ(x, again);
}

TEST_P(EverySolver, ManyRightHandSidesEqualSingleSolves) {
  const BlockTree tree = random_tree(Shape::chain, Dims::mixed, 23, 5);
  const std::size_t size = tree.size();
  const auto many = entry().make({}), single = entry().make({});
  const std::vector<double> b = random_vector(3 * tree.size(), 6);
  std::vector<double> x(b.size(), 0.0);
  ASSERT_TRUE(many->solve_many(tree, 3, b, x).ok());
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<double> y(size, 0.0);
    ASSERT_TRUE(single->solve(tree, std::span(b).subspan(k * size, size), y).ok());
    for (std::size_t i = 0; i < size; ++i) EXPECT_EQ(x[k * size + i], y[i]);
  }
}

TEST_P(EverySolver, ANegativeInertiaIsNamed) {
  for (Shape shape : {Shape::chain, Shape::star}) {
    BlockTree tree = random_tree(shape, Dims::five, 12, 5);
    if (!takes(tree)) continue;
    for (double& value : tree.diag[4]) value = -value;
    std::vector<double> x(tree.size(), 0.0);
    const Report report = entry().make({})->solve(tree, random_vector(tree.size(), 1), x);
    EXPECT_EQ(report.outcome, Outcome::not_positive_definite);
    EXPECT_EQ(report.node, 4);
  }
}

TEST_P(EverySolver, NotANumberIsNotIndefinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (Shape shape : {Shape::chain, Shape::star}) {
    const BlockTree good = random_tree(shape, Dims::five, 12, 5);
    if (!takes(good)) continue;
    const std::vector<double> b = random_vector(good.size(), 1);
    std::vector<double> x(good.size(), 0.0), bad_b = b;
    BlockTree tree = good;
    tree.diag[4][0] = nan;
    EXPECT_EQ(entry().make({})->solve(tree, b, x).outcome, Outcome::not_finite);
    tree = good;
    if (shape == Shape::chain)
      tree.parent_block[6][2] = nan;
    else
      tree.hubs[0].compliance[7] = nan;
    std::fill(x.begin(), x.end(), 0.0);
    EXPECT_EQ(entry().make({})->solve(tree, b, x).outcome, Outcome::not_finite);
    bad_b[7] = std::numeric_limits<double>::infinity();
    std::fill(x.begin(), x.end(), 0.0);
    EXPECT_EQ(entry().make({})->solve(good, bad_b, x).outcome, Outcome::not_finite);
  }
}

TEST_P(EverySolver, AnExactGuessIsAccepted) {
  for (Shape shape : shapes) {
    const BlockTree tree = random_tree(shape, Dims::five, 9, 5);
    if (!takes(tree)) continue;
    const Dense dense = dense_twin(tree);
    const std::vector<double> b = random_vector(tree.size(), 1);
    const std::vector<double> exact = cholesky_solve(dense, b);
    for (double off : {0.0, 1e-16, 1e-15, 1e-13}) {
      std::vector<double> x = exact;
      for (std::size_t i = 0; i < x.size(); ++i) x[i] *= 1.0 + off * static_cast<double>(i % 3);
      const Report report = entry().make({})->solve(tree, b, x);
      EXPECT_TRUE(report.ok()) << to_string(report.outcome) << ' ' << off;
      EXPECT_LE(report.iterations, 2);
      EXPECT_LE(energy_error(dense, x, exact), 1e-11);
    }
  }
}

TEST_P(EverySolver, AUselessGuessDoesNoHarm) {
  const BlockTree tree = random_tree(Shape::chain, Dims::five, 9, 5);
  const Dense dense = dense_twin(tree);
  const std::vector<double> b = random_vector(tree.size(), 1);
  const std::vector<double> exact = cholesky_solve(dense, b);
  for (double guess : {1e6, 1e15, std::numeric_limits<double>::quiet_NaN()}) {
    std::vector<double> x(tree.size(), guess);
    ASSERT_TRUE(entry().make({})->solve(tree, b, x).ok());
    EXPECT_LE(energy_error(dense, x, exact), 3e-7);
  }
}

TEST(Registry, SolversOfChainsRefuseBranches) {
  int refusing = 0;
  for (const SolverEntry& entry : solver_table()) {
    if (!entry.chains_only) continue;
    ++refusing;
    const BlockTree tree = random_tree(Shape::star, Dims::five, 4, 5);
    std::vector<double> x(tree.size());
    try {
      entry.make({})->solve(tree, random_vector(tree.size(), 1), x);
      ADD_FAILURE() << entry.name << " took a star";
    } catch (const InputError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(entry.name), std::string::npos) << text;
      EXPECT_NE(text.find("use 'thomas'"), std::string::npos) << text;
    }
  }
  EXPECT_GE(refusing, 2);
}

INSTANTIATE_TEST_SUITE_P(Table, EverySolver,
                         ::testing::ValuesIn(solver_table().begin(), solver_table().end()),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace linkwise::testing
