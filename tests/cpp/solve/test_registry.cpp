#include <cmath>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "base/error_of.hpp"
#include "linear/block_tree_scenes.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/solve/initial_guess.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise::testing {
namespace {

TEST(Registry, NamesAreUniqueAndDescribed) {
  std::set<std::string_view> names;
  for (const SolverEntry& entry : solver_table()) {
    EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
    EXPECT_FALSE(entry.description.empty()) << entry.name;
    EXPECT_FALSE(entry.reference.empty()) << entry.name;
    EXPECT_NE(make_solver(entry.name), nullptr);
    EXPECT_EQ(&find_solver(entry.name), &entry);
  }
  for (const char* name :
       {"thomas", "conjugate_gradient", "jacobi", "gauss_seidel", "sor", "chebyshev", "two_level"})
    EXPECT_TRUE(names.contains(name)) << name;
}

TEST(Registry, UnknownNamesListTheKnownOnes) {
  const std::string solver = error_of([] { make_solver("thomass"); });
  EXPECT_NE(solver.find("solver 'thomass' is unknown"), std::string::npos) << solver;
  for (const SolverEntry& entry : solver_table())
    EXPECT_NE(solver.find(entry.name), std::string::npos) << entry.name;
  const std::string guess = error_of([] { make_initial_guess("cubix"); });
  EXPECT_NE(guess.find("initial guess 'cubix' is unknown"), std::string::npos) << guess;
  for (const InitialGuessEntry& entry : initial_guess_table())
    EXPECT_NE(guess.find(entry.name), std::string::npos) << entry.name;
  EXPECT_EQ(error_of([] { stop_rule_from_name("energy"); }),
            "stop rule 'energy' is unknown; known: paper, residual, energy_norm");
  EXPECT_EQ(error_of([] { SolverOptions().set("form", "four_term"); }),
            "solver options: form is 'four_term'; known are two_term, three_term");
  const std::string option = error_of([] { SolverOptions().set("omga", 1.0); });
  EXPECT_NE(option.find("key 'omga' is unknown; known: tolerance, "), std::string::npos) << option;
  for (const SolverOption& known : solver_options())
    EXPECT_NE(option.find(known.option->name), std::string::npos) << option;
}

TEST(Registry, NamesAndValuesAreInverse) {
  for (StopRule rule : {StopRule::paper, StopRule::residual, StopRule::energy_norm})
    EXPECT_EQ(stop_rule_from_name(to_string(rule)), rule);
}

TEST(Registry, OptionsOutOfRangeAreRejectedByName) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto rejects = [](const char* name, auto set) {
    const std::string text = error_of([&] {
      SolverOptions options;
      set(options);
      make_solver("conjugate_gradient", options);
    });
    EXPECT_EQ(text.find("solver options: " + std::string(name) + " is "), 0u) << text;
    EXPECT_NE(text.find("; "), std::string::npos) << text;
  };
  for (double value : {0.0, -1e-7, nan, std::numeric_limits<double>::infinity()})
    rejects("tolerance", [=](SolverOptions& o) { o.tolerance = value; });
  for (double value : {-1.0, nan})
    rejects("absolute_tolerance", [=](SolverOptions& o) { o.absolute_tolerance = value; });
  rejects("max_iterations", [](SolverOptions& o) { o.max_iterations = -1; });
  for (double value : {0.0, 2.0, -0.5, 2.5, nan})
    rejects("omega", [=](SolverOptions& o) { o.set("omega", value); });
  for (double value : {1.0, -0.1, nan})
    rejects("spectral_radius", [=](SolverOptions& o) { o.set("spectral_radius", value); });
  for (const char* name : {"max_iterations", "block_size", "refinement_steps"})
    rejects(name, [=](SolverOptions& o) { o.set(name, -1); });
  for (const char* name : {"lag_limit", "history"})
    rejects(name, [=](SolverOptions& o) { o.set(name, 0); });
}

TEST(Registry, OptionsOfAnotherTypeAreRejectedByName) {
  const auto text = [](const char* name, OptionValue value) {
    return error_of([&] { SolverOptions().set(name, value); });
  };
  EXPECT_EQ(text("omega", true), "solver options: omega is true; give a number");
  EXPECT_EQ(text("block_size", 1.5), "solver options: block_size is 1.5; give a whole number");
  EXPECT_EQ(text("estimate_error", 1), "solver options: estimate_error is 1; give True or False");
  EXPECT_EQ(text("form", 2), "solver options: form is 2; give a name in quotes");
  EXPECT_EQ(text("omega", 1), "no error");  // a whole number is a number
}

TEST(Registry, RowsThatFixAnOptionTakeNoOther) {
  const BlockTree tree = random_tree(Shape::chain, Dims::five, 20, 3);
  const std::vector<double> b = random_vector(tree.size(), 4);
  const auto solve = [&](const char* name, const SolverOptions& options) {
    std::vector<double> x(b.size(), 0.0);
    make_solver(name, options)->solve(tree, b, x);
    return x;
  };
  SolverOptions plain, relaxed, coloured;
  relaxed.set("omega", 1.3);
  coloured.set("order", "red_black");
  EXPECT_EQ(solve("gauss_seidel", relaxed), solve("gauss_seidel", plain));
  EXPECT_EQ(solve("sor", coloured), solve("red_black_sor", plain));
  EXPECT_NE(solve("sor", relaxed), solve("sor", plain));
  coloured.set("omega", 1.0);
  EXPECT_EQ(solve("sor", coloured), solve("red_black_gauss_seidel", relaxed));
}

}  // namespace
}  // namespace linkwise::testing
