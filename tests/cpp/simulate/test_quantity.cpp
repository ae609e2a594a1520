// The tables of what is recorded and of the numerical options.
#include <set>

#include <gtest/gtest.h>

#include "linkwise/base/error.hpp"
#include "linkwise/simulate/numerics.hpp"
#include "linkwise/simulate/quantity.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

TEST(Quantities, EachHasAWriterAndTexts) {
  std::set<std::string_view> names;
  for (const QuantityEntry& entry : quantity_table()) {
    names.insert(entry.name);
    EXPECT_NE(entry.write != nullptr, entry.count != nullptr) << entry.name;
    EXPECT_FALSE(entry.long_name.empty()) << entry.name;
    EXPECT_EQ(&entry, &quantity_table()[quantity_index(entry.name)]);
  }
  EXPECT_EQ(names.size(), quantity_table().size());
  EXPECT_THROW(quantity_index("entropy"), InputError);
}

// Every quantity fills its whole width and nothing more.
TEST(Quantities, AreAsWideAsTheySay) {
  const auto model = make_model(every_kind());
  Simulation simulation(model, fixed_step(1e-2));
  const std::vector<double> q = model->neutral_configuration(), v(model->nv(), 0.1);
  simulation.start(0, {q.data(), v.data()});
  for (size_t k = 0; k < quantity_table().size(); ++k) {
    const QuantityEntry& entry = quantity_table()[k];
    const size_t width = quantity_width(entry, *model);
    std::vector<double> values(width + 1, -7);
    std::vector<std::int64_t> counts(width + 1, -7);
    Sample sample;
    (entry.count ? static_cast<void>(sample.counts[k] = counts.data())
                 : static_cast<void>(sample.values[k] = values.data()));
    ASSERT_TRUE(simulation.advance(0.05, sample));
    for (size_t i = 0; i < width; ++i)
      EXPECT_TRUE(entry.count ? counts[i] >= 0 : values[i] != -7) << entry.name;
    EXPECT_TRUE(values[width] == -7 && counts[width] == -7) << entry.name;
  }
}

TEST(Numerics, ShareOfTheToleranceGoesToAStepAndToTheForces) {
  Numerics numerics;
  numerics.tolerance = 1e-4;
  EXPECT_DOUBLE_EQ(simulation_options(numerics, Executor()).integration.tolerance, 1e-5);
  EXPECT_DOUBLE_EQ(simulation_options(numerics, Executor()).dynamics.solver_options.tolerance,
                   1e-6);
  EXPECT_TRUE(simulation_options(numerics, Executor()).follow_error_test);
  numerics.step_tolerance = 1e-3;
  numerics.solver_tolerance = 1e-9;
  EXPECT_DOUBLE_EQ(simulation_options(numerics, Executor()).integration.tolerance, 1e-3);
  EXPECT_DOUBLE_EQ(simulation_options(numerics, Executor()).dynamics.solver_options.tolerance,
                   1e-9);
  EXPECT_FALSE(simulation_options(numerics, Executor()).follow_error_test);
}

// An accuracy that is asked of the solver itself is not the error test's to choose.
TEST(Numerics, AToleranceOfTheSolverIsFixed) {
  const auto follows = [](const SolverOptionValues& values) {
    return simulation_options({}, Executor(), values).follow_error_test;
  };
  EXPECT_TRUE(follows({}));
  EXPECT_TRUE(follows({{"omega", 1.5}}));
  EXPECT_FALSE(follows({{"tolerance", 1e-9}}));
  EXPECT_FALSE(follows({{"omega", 1.5}, {"absolute_tolerance", 1e-9}}));
  EXPECT_EQ(
      simulation_options({}, Executor(), {{"tolerance", 1e-9}}).dynamics.solver_options.tolerance,
      1e-9);
  EXPECT_THROW(follows({{"magic", 1.5}}), InputError);
  EXPECT_THROW(follows({{"tolerance", -1.0}}), InputError);
}

TEST(Numerics, RefusesWhatItDoesNotKnow) {
  EXPECT_THROW(find_numerics("speed"), InputError);
  for (const NumericsEntry& entry : numerics_table()) EXPECT_EQ(&find_numerics(entry.name), &entry);
  Numerics numerics;
  numerics.tolerance = -1;
  EXPECT_THROW(simulation_options(numerics, Executor()), InputError);
  numerics = {};
  numerics.integrator = "magic";
  EXPECT_THROW(simulation_options(numerics, Executor()), InputError);
}

}  // namespace
}  // namespace linkwise::testing
