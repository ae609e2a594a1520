#include <cmath>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "linkwise/base/error.hpp"
#include "linkwise/solve/initial_guess.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise::testing {
namespace {

template <class F>
std::string complaint(F&& f) {
  try {
    f();
  } catch (const InputError& error) {
    return error.what();
  }
  return "(nothing)";
}

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
  const std::string solver = complaint([] { make_solver("thomass"); });
  EXPECT_NE(solver.find("unknown solver 'thomass'"), std::string::npos) << solver;
  for (const SolverEntry& entry : solver_table())
    EXPECT_NE(solver.find(entry.name), std::string::npos) << entry.name;
  const std::string guess = complaint([] { make_initial_guess("cubix"); });
  EXPECT_NE(guess.find("unknown initial guess 'cubix'"), std::string::npos) << guess;
  for (const InitialGuessEntry& entry : initial_guess_table())
    EXPECT_NE(guess.find(entry.name), std::string::npos) << entry.name;
  EXPECT_EQ(complaint([] { stop_rule_from_name("energy"); }),
            "unknown stop rule 'energy'; known are paper, residual, energy_norm");
  EXPECT_EQ(complaint([] { conjugate_gradient_form_from_name("four_term"); }),
            "unknown form of conjugate gradients 'four_term'; known are two_term, three_term");
  EXPECT_EQ(complaint([] { relaxation_choice_from_name("best"); }),
            "unknown choice of the relaxation factor 'best'; known are optimal, given, adaptive");
}

TEST(Registry, NamesAndValuesAreInverse) {
  for (StopRule rule : {StopRule::paper, StopRule::residual, StopRule::energy_norm})
    EXPECT_EQ(stop_rule_from_name(to_string(rule)), rule);
  for (RelaxationChoice choice :
       {RelaxationChoice::optimal, RelaxationChoice::given, RelaxationChoice::adaptive})
    EXPECT_EQ(relaxation_choice_from_name(to_string(choice)), choice);
  for (ConjugateGradientForm form :
       {ConjugateGradientForm::two_term, ConjugateGradientForm::three_term})
    EXPECT_EQ(conjugate_gradient_form_from_name(to_string(form)), form);
}

TEST(Registry, OptionsOutOfRangeAreRejectedByName) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto rejects = [](const char* name, auto set) {
    SolverOptions options;
    set(options);
    const std::string text = complaint([&] { make_solver("conjugate_gradient", options); });
    EXPECT_EQ(text.find("solver options: " + std::string(name) + " is "), 0u) << text;
    EXPECT_NE(text.find("; "), std::string::npos) << text;
  };
  for (double value : {0.0, -1e-7, nan, std::numeric_limits<double>::infinity()})
    rejects("tolerance", [=](SolverOptions& o) { o.tolerance = value; });
  for (double value : {-1.0, nan})
    rejects("absolute_tolerance", [=](SolverOptions& o) { o.absolute_tolerance = value; });
  for (double value : {0.0, 2.0, -0.5, 2.5, nan})
    rejects("omega", [=](SolverOptions& o) { o.omega = value; });
  for (double value : {1.0, -0.1, nan})
    rejects("spectral_radius", [=](SolverOptions& o) { o.spectral_radius = value; });
  rejects("max_iterations", [](SolverOptions& o) { o.max_iterations = -1; });
  rejects("block_size", [](SolverOptions& o) { o.block_size = -2; });
  rejects("refinement_steps", [](SolverOptions& o) { o.refinement_steps = -1; });
  rejects("lag_limit", [](SolverOptions& o) { o.lag_limit = 0; });
  EXPECT_NE(complaint([] { make_initial_guess("projection", {.history = 0}); }), "(nothing)");
}

}  // namespace
}  // namespace linkwise::testing
