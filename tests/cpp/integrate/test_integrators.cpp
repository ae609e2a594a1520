#include <algorithm>
#include <limits>
#include <ostream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "integrate/closed_form_systems.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/integrate/integrator.hpp"

namespace linkwise {

void PrintTo(const IntegratorEntry& entry, std::ostream* out) { *out << entry.name; }

}  // namespace linkwise

namespace linkwise::test {
namespace {

IntegratorOptions usable_options(const IntegratorEntry& entry, double step = 1e-3) {
  IntegratorOptions options;
  if (entry.fixed_step) options.step = step;
  return options;
}

std::string message_of(std::string_view kind, const IntegratorOptions& options) {
  ForcedOscillator system;
  try {
    make_integrator(kind, system, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// What every entry of the registry promises.
class EveryIntegrator : public testing::TestWithParam<IntegratorEntry> {
 protected:
  const IntegratorEntry& entry() { return GetParam(); }
  std::unique_ptr<Integrator> make(OdeSystem& system, double step = 1e-3) {
    return make_integrator(entry().name, system, usable_options(entry(), step));
  }
};

TEST_P(EveryIntegrator, IsFoundByName) {
  EXPECT_EQ(find_integrator(entry().name).make, entry().make);
  EXPECT_FALSE(entry().description.empty());
}

TEST_P(EveryIntegrator, GivesTheInitialStateBeforeTheFirstStep) {
  ForcedOscillator system;
  const auto integrator = make(system);
  const std::vector<double> y0 = {0.25, -3.0};
  integrator->start(7.5, y0);
  std::vector<double> y(2);
  integrator->interpolate(7.5, y);
  EXPECT_EQ(y, y0);
  EXPECT_EQ(integrator->time(), 7.5);
  EXPECT_EQ(integrator->statistics().steps, 0);
}

TEST_P(EveryIntegrator, FollowsTheClosedForm) {
  ForcedOscillator system;
  const auto integrator = make(system, 1e-4);
  integrator->start(0.0, ForcedOscillator::initial());
  const std::vector<double> y = integrate_to(*integrator, 3.0, 2);
  EXPECT_LT(ForcedOscillator::error(3.0, y), entry().highest_order == 1 ? 1e-3 : 1e-4);
  EXPECT_GE(integrator->statistics().steps, 10);
  EXPECT_GE(integrator->statistics().evaluations, integrator->statistics().steps);
  EXPECT_GE(integrator->statistics().last_order, 1);
  EXPECT_LE(integrator->statistics().last_order, entry().highest_order);
}

TEST_P(EveryIntegrator, DoesNotDependOnWhereOutputIsAskedFor) {
  ForcedOscillator system;
  const auto plain = make(system), asked = make(system);
  plain->start(0.0, ForcedOscillator::initial());
  asked->start(0.0, ForcedOscillator::initial());
  std::vector<double> at_plain(2), at_asked(2), between(2);
  for (int i = 0; i < 200; ++i) {
    const double before = asked->time();
    ASSERT_EQ(plain->step(1e9), Outcome::converged);
    ASSERT_EQ(asked->step(before + 1e-5), Outcome::converged);
    for (const double s : {0.1, 0.7}) {
      asked->interpolate(before + s * (asked->time() - before), between);
    }
    ASSERT_EQ(plain->time(), asked->time());
    plain->interpolate(plain->time(), at_plain);
    asked->interpolate(asked->time(), at_asked);
    ASSERT_EQ(at_plain, at_asked) << "step " << i;
  }
}

TEST_P(EveryIntegrator, InterpolatesContinuouslyAcrossSteps) {
  ForcedOscillator system;
  const auto integrator = make(system, 0.01);
  integrator->start(0.0, ForcedOscillator::initial());
  std::vector<double> end(2), begin(2);
  for (int i = 0; i < 50; ++i) {
    const double before = integrator->time();
    integrator->interpolate(before, end);
    ASSERT_EQ(integrator->step(1e9), Outcome::converged);
    // The polynomials of two steps of a multistep method meet within its tolerance.
    integrator->interpolate(before + 1e-9 * (integrator->time() - before), begin);
    EXPECT_NEAR(begin[0], end[0], 2e-5);
    EXPECT_NEAR(begin[1], end[1], 2e-5);
  }
}

TEST_P(EveryIntegrator, RepeatsItselfAfterASecondStart) {
  ForcedOscillator system;
  const auto integrator = make(system);
  integrator->start(0.0, ForcedOscillator::initial());
  const std::vector<double> first = integrate_to(*integrator, 1.0, 2);
  const IntegratorStatistics counted = integrator->statistics();
  integrator->start(0.0, ForcedOscillator::initial());
  EXPECT_EQ(integrate_to(*integrator, 1.0, 2), first);
  EXPECT_EQ(integrator->statistics().steps, counted.steps);
  EXPECT_EQ(integrator->statistics().evaluations, counted.evaluations);
}

TEST_P(EveryIntegrator, KeepsQuaternionsAtUnitLength) {
  SpinningBody system;
  const auto integrator = make(system);
  std::vector<double> y0 = SpinningBody::initial(3.0), y(7);
  for (int i = 0; i < 4; ++i) y0[static_cast<std::size_t>(i)] *= 1.5;
  integrator->start(0.0, y0);
  while (integrator->time() < 2.0) {
    const double before = integrator->time();
    ASSERT_EQ(integrator->step(2.0), Outcome::converged);
    for (const double s : {0.25, 0.5, 1.0}) {
      integrator->interpolate(before + s * (integrator->time() - before), y);
      ASSERT_NEAR(SpinningBody::norm(y), 1.0, 1e-14);
    }
  }
  integrator->interpolate(integrator->time(), y);
  EXPECT_NEAR(y[2], std::sin(1.5 * integrator->time()), entry().highest_order == 1 ? 1e-2 : 1e-4);
}

TEST_P(EveryIntegrator, ReportsAnEvaluationThatFails) {
  FirstOrder system(1, [](double t, const double*, double* rate) {
    rate[0] = 1.0;
    return t < 1.0;
  });
  const auto integrator = make(system);
  integrator->start(0.0, std::vector<double>{0.0});
  testing::internal::CaptureStderr();
  Outcome outcome = Outcome::converged;
  const std::vector<double> y = integrate_to(*integrator, 2.0, 1, &outcome);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(outcome, Outcome::not_positive_definite);
  EXPECT_GT(integrator->time(), 0.95);
  EXPECT_LE(integrator->time(), 1.0);
  EXPECT_NEAR(y[0], integrator->time(), 1e-9) << "the last accepted state stays readable";
}

TEST_P(EveryIntegrator, ReportsRatesThatAreNotFinite) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    FirstOrder system(3, [bad](double t, const double*, double* rate) {
      rate[0] = rate[2] = 1.0;
      rate[1] = t < 0.5 ? 0.0 : bad;
      return true;
    });
    const auto integrator = make(system);
    integrator->start(0.0, std::vector<double>(3, 0.0));
    Outcome outcome = Outcome::converged;
    const std::vector<double> y = integrate_to(*integrator, 2.0, 3, &outcome);
    EXPECT_EQ(outcome, Outcome::not_finite);
    EXPECT_LE(integrator->time(), 0.5);
    EXPECT_NEAR(y[0], integrator->time(), 1e-9);
  }
}

TEST_P(EveryIntegrator, FailsInTheVeryFirstEvaluationWithoutMoving) {
  FirstOrder system(1, [](double, const double*, double*) { return false; });
  const auto integrator = make(system);
  integrator->start(3.0, std::vector<double>{2.0});
  testing::internal::CaptureStderr();
  EXPECT_EQ(integrator->step(4.0), Outcome::not_positive_definite);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(integrator->time(), 3.0);
  std::vector<double> y(1);
  integrator->interpolate(3.0, y);
  EXPECT_EQ(y[0], 2.0);
}

TEST_P(EveryIntegrator, LetsExceptionsOfTheSystemThrough) {
  FirstOrder system(1, [](double t, const double*, double* rate) {
    rate[0] = 1.0;
    if (t > 0.1) throw std::domain_error("from the drive");
    return true;
  });
  const auto integrator = make(system);
  integrator->start(0.0, std::vector<double>{0.0});
  EXPECT_THROW(integrate_to(*integrator, 1.0, 1), std::domain_error);
}

TEST_P(EveryIntegrator, StopsAtItsMaximumOfSteps) {
  ForcedOscillator system;
  IntegratorOptions options = usable_options(entry());
  options.max_steps = 17;
  const auto integrator = make_integrator(entry().name, system, options);
  integrator->start(0.0, ForcedOscillator::initial());
  Outcome outcome = Outcome::converged;
  integrate_to(*integrator, 100.0, 2, &outcome);
  EXPECT_EQ(outcome, Outcome::too_many_steps);
  EXPECT_EQ(integrator->statistics().steps, 17);
}

TEST_P(EveryIntegrator, AdvancesASystemWithoutUnknowns) {
  FirstOrder system(0, [](double, const double*, double*) { return true; });
  const auto integrator = make(system);
  integrator->start(0.0, std::vector<double>{});
  Outcome outcome = Outcome::converged;
  integrate_to(*integrator, 0.5, 0, &outcome);
  EXPECT_EQ(outcome, Outcome::converged);
  EXPECT_GE(integrator->time(), 0.5);
}

/// v' = 8 between 2.03 and 2.08, else 0: the value at either time itself is wrong.
struct Pulsed : FirstOrder {
  static constexpr double begin = 2.03, end = 2.08;
  Pulsed()
      : FirstOrder(1, [this](double t, const double*, double* ydot) {
          ydot[0] = t == begin || t == end ? 1e6 : t > begin && t < end ? 8.0 : 0.0;
          evaluated.push_back(t);
          return true;
        }) {}
  double step_limit(double t) override {
    return t < begin ? begin : t < end ? end : std::numeric_limits<double>::infinity();
  }
  bool breaks_at(double t) override { return t == begin || t == end; }

  std::vector<double> evaluated;
};

TEST_P(EveryIntegrator, MeetsEveryBreakOfTheSystem) {
  Pulsed system;
  const auto integrator = make(system, 0.5);
  integrator->start(0.0, std::vector<double>{0.0});
  double before = 0.0;
  while (integrator->time() < 3.0) {
    system.evaluated.clear();
    ASSERT_EQ(integrator->step(3.0), Outcome::converged);
    for (const double t : system.evaluated)
      for (const double at : {Pulsed::begin, Pulsed::end}) {
        EXPECT_FALSE(before >= at && t < at) << t;
        EXPECT_FALSE(integrator->time() <= at && t > at) << t;
      }
    before = integrator->time();
  }
  for (const double at : {Pulsed::begin, Pulsed::end})
    EXPECT_EQ(std::count(system.accepted_times.begin(), system.accepted_times.end(), at), 1);
  EXPECT_LT(system.accepted_times.size(), 60);
  std::vector<double> v(1);
  integrator->interpolate(3.0, v);
  EXPECT_NEAR(v[0], 8.0 * (Pulsed::end - Pulsed::begin), 1e-9);
}

TEST_P(EveryIntegrator, AnnouncesEveryAcceptedStep) {
  FirstOrder system(1, [](double t, const double*, double* rate) {
    rate[0] = std::cos(t);
    return true;
  });
  const auto integrator = make(system);
  integrator->start(0.0, std::vector<double>{0.0});
  std::vector<double> times;
  while (integrator->time() < 0.3) {
    ASSERT_EQ(integrator->step(0.3), Outcome::converged);
    times.push_back(integrator->time());
  }
  EXPECT_EQ(system.accepted_times, times);
}

TEST_P(EveryIntegrator, RejectsOptionsOutOfRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1e-6, nan, std::numeric_limits<double>::infinity()}) {
    IntegratorOptions options = usable_options(entry());
    options.tolerance = bad;
    EXPECT_NE(message_of(entry().name, options).find("tolerance"), std::string::npos) << bad;
  }
  for (const double bad : {-1.0, nan}) {
    IntegratorOptions options = usable_options(entry());
    options.max_step = bad;
    EXPECT_NE(message_of(entry().name, options).find("max_step"), std::string::npos) << bad;
    options = usable_options(entry());
    options.relative_tolerance = bad;
    EXPECT_NE(message_of(entry().name, options).find("relative"), std::string::npos) << bad;
    options = usable_options(entry());
    options.absolute_tolerance = bad;
    EXPECT_NE(message_of(entry().name, options).find("absolute"), std::string::npos) << bad;
  }
  for (const int bad : {-1, entry().highest_order + 1}) {
    IntegratorOptions options = usable_options(entry());
    options.max_order = bad;
    EXPECT_NE(message_of(entry().name, options).find("max_order"), std::string::npos) << bad;
  }
  IntegratorOptions options = usable_options(entry());
  options.max_steps = -1;
  EXPECT_NE(message_of(entry().name, options).find("max_steps"), std::string::npos);
  options = usable_options(entry());
  options.step = entry().fixed_step ? -0.1 : 0.1;
  EXPECT_NE(message_of(entry().name, options).find("step"), std::string::npos);
  EXPECT_EQ(message_of(entry().name, usable_options(entry())), "");
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryIntegrator,
                         testing::ValuesIn(integrator_registry().begin(),
                                           integrator_registry().end()),
                         [](const auto& entry) { return std::string(entry.param.name); });

TEST(IntegratorRegistry, HasUniqueNames) {
  std::set<std::string_view> names;
  for (const IntegratorEntry& entry : integrator_registry()) names.insert(entry.name);
  EXPECT_EQ(names.size(), integrator_registry().size());
}

TEST(IntegratorRegistry, ListsTheKnownNamesForAnUnknownOne) {
  try {
    find_integrator("rk4");
    FAIL();
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("'rk4'"), std::string::npos);
    for (const IntegratorEntry& entry : integrator_registry()) {
      EXPECT_NE(message.find(entry.name), std::string::npos) << message;
    }
  }
}

}  // namespace
}  // namespace linkwise::test
