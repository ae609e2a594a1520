#include <cmath>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/solve/initial_guess.hpp"
#include "linkwise/solve/solver.hpp"

namespace linkwise::testing {
namespace {

const std::vector<double> no_b;
const BlockTree no_tree;

std::vector<double> polynomial(double t, int degree) {
  return {1.0 + t * (degree > 0) - 0.5 * t * t * (degree > 1) + 0.25 * t * t * t * (degree > 2),
          -3.0 + 2.0 * t * (degree > 0)};
}

/// The guess at t after accepting a polynomial of the degree at uneven times.
std::vector<double> guess_after(InitialGuess& guess, int degree, int accepted, double t) {
  const double times[] = {0.0, 0.1, 0.35, 0.4, 0.9, 1.0};
  for (int k = 0; k < accepted; ++k) guess.accept(times[k], polynomial(times[k], degree));
  std::vector<double> x(2, std::nan(""));
  guess.predict(t, no_tree, no_b, x);
  return x;
}

TEST(InitialGuess, PolynomialsAreExactOnUnevenTimes) {
  const std::pair<const char*, int> kinds[] = {{"previous", 0}, {"linear", 1}, {"cubic", 3}};
  for (const auto& [name, degree] : kinds) {
    const auto guess = make_initial_guess(name);
    const std::vector<double> x = guess_after(*guess, degree, 6, 1.3);
    const std::vector<double> expected = polynomial(1.3, degree);
    for (int i = 0; i < 2; ++i) EXPECT_NEAR(x[i], expected[i], 1e-12) << name;
  }
}

TEST(InitialGuess, WorksUpToItsOrderAtTheStart) {
  const auto cubic = make_initial_guess("cubic");
  EXPECT_EQ(guess_after(*cubic, 3, 0, 0.2), (std::vector<double>{0.0, 0.0}));
  cubic->reset();
  EXPECT_EQ(guess_after(*cubic, 3, 1, 0.2), polynomial(0.0, 3));
  cubic->reset();
  const std::vector<double> line = guess_after(*cubic, 1, 2, 0.2);
  EXPECT_NEAR(line[0], polynomial(0.2, 1)[0], 1e-14);
}

TEST(InitialGuess, TheSameTimeIsReused) {
  const std::vector<double> solution{5.0, 6.0};
  for (const InitialGuessEntry& entry : initial_guess_table()) {
    const auto guess = entry.make({});
    guess->solved(0.7, solution);
    std::vector<double> x(2);
    guess->predict(0.7, no_tree, no_b, x);
    const bool stateless = entry.name == "zero";
    EXPECT_EQ(x, stateless ? std::vector<double>(2, 0.0) : solution) << entry.name;
    guess->predict(0.8, no_tree, no_b, x);
    EXPECT_EQ(x, std::vector<double>(2, 0.0)) << entry.name;
  }
}

TEST(InitialGuess, GoingBackInTimeDropsTheFuture) {
  const auto linear = make_initial_guess("linear");
  for (double t : {0.0, 1.0, 2.0}) linear->accept(t, polynomial(t, 1));
  linear->accept(1.0, std::vector<double>{7.0, 7.0});
  std::vector<double> x(2);
  linear->predict(1.5, no_tree, no_b, x);
  EXPECT_EQ(x, (std::vector<double>{7.0, 7.0}));  // the older sample has left the history of two
}

TEST(InitialGuess, AnotherSizeStartsAfresh) {
  const auto cubic = make_initial_guess("cubic");
  cubic->accept(0.0, std::vector<double>{1.0, 2.0});
  std::vector<double> x(3, 9.0);
  cubic->predict(0.1, no_tree, no_b, x);
  EXPECT_EQ(x, std::vector<double>(3, 0.0));
  cubic->accept(0.1, std::vector<double>{1.0, 2.0, 3.0});
  cubic->predict(0.2, no_tree, no_b, x);
  EXPECT_EQ(x, (std::vector<double>{1.0, 2.0, 3.0}));
}

TEST(InitialGuess, ProjectionFindsWhatTheHistorySpans) {
  const BlockTree tree = random_tree(Shape::bushy_tree, Dims::mixed, 12, 3);
  const Dense dense = dense_twin(tree);
  SolverOptions options;
  options.set("history", 3);
  const auto projection = make_initial_guess("projection", options.own);
  std::vector<std::vector<double>> stored;
  for (int k = 0; k < 3; ++k) {
    stored.push_back(random_vector(tree.size(), 20 + k));
    projection->accept(k, stored[k]);
  }
  projection->accept(3.0, stored[2]);  // a repeated one spans nothing new and pushes out the first
  std::vector<double> exact(tree.size());
  for (int i = 0; i < tree.size(); ++i) exact[i] = 2.0 * stored[1][i] - 0.5 * stored[2][i];
  std::vector<double> x(tree.size());
  projection->predict(4.0, tree, multiply(dense, exact), x);
  EXPECT_LT(energy_error(dense, x, exact), 1e-12);

  // Outside of the span it is the best one: the error is A-orthogonal to every stored solution.
  const std::vector<double> other = random_vector(tree.size(), 77);
  projection->predict(4.0, tree, multiply(dense, other), x);
  std::vector<double> e(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) e[i] = other[i] - x[i];
  const std::vector<double> ae = multiply(dense, e);
  for (int k = 1; k < 3; ++k) {
    double product = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) product += stored[k][i] * ae[i];
    EXPECT_NEAR(product, 0.0, 1e-9);
  }
}

}  // namespace
}  // namespace linkwise::testing
