#include <cmath>
#include <numbers>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "integrate/closed_form_systems.hpp"
#include "linkwise/integrate/integrator.hpp"

namespace linkwise::test {
namespace {

std::unique_ptr<Integrator> make(std::string_view kind, OdeSystem& system, double tolerance) {
  IntegratorOptions options;
  options.tolerance = tolerance;
  return make_integrator(kind, system, options);
}

struct Errors {
  double at_steps = 0.0, between_steps = 0.0;
};

Errors errors_at(std::string_view kind, double tolerance) {
  ForcedOscillator system;
  const auto integrator = make(kind, system, tolerance);
  integrator->start(0.0, ForcedOscillator::initial());
  Errors errors;
  std::vector<double> y(2);
  while (integrator->time() < 10.0) {
    const double before = integrator->time();
    EXPECT_EQ(integrator->step(10.0), Outcome::converged);
    const double t = integrator->time();
    integrator->interpolate(t, y);
    errors.at_steps = std::max(errors.at_steps, ForcedOscillator::error(t, y));
    for (const double s : {0.2, 0.5, 0.8}) {
      integrator->interpolate(before + s * (t - before), y);
      errors.between_steps =
          std::max(errors.between_steps, ForcedOscillator::error(before + s * (t - before), y));
    }
  }
  return errors;
}

void expect_proportional_to_tolerance(std::string_view kind, std::vector<double> tolerances,
                                      double largest_ratio) {
  std::vector<double> at_steps, between_steps;
  for (const double tolerance : tolerances) {
    const Errors errors = errors_at(kind, tolerance);
    at_steps.push_back(errors.at_steps);
    between_steps.push_back(errors.between_steps);
    EXPECT_LT(errors.at_steps, largest_ratio * tolerance) << tolerance;
    EXPECT_LT(errors.between_steps, 1.5 * errors.at_steps) << tolerance;
  }
  EXPECT_NEAR(log_slope(tolerances, at_steps), 1.0, 0.25);
  EXPECT_NEAR(log_slope(tolerances, between_steps), 1.0, 0.25);
}

TEST(Adams, HasErrorsProportionalToTheTolerance) {
  expect_proportional_to_tolerance("adams", {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11},
                                   100.0);
}

TEST(Bdf, HasErrorsProportionalToTheTolerance) {
  expect_proportional_to_tolerance("bdf", {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}, 200.0);
}

/// v' = -1e5 (v - cos t) - sin t, whose solution from v(0) = 1 is cos t.
FirstOrder stiff_system() {
  return FirstOrder(1, [](double t, const double* v, double* rate) {
    rate[0] = -1e5 * (v[0] - std::cos(t)) - std::sin(t);
    return true;
  });
}

TEST(Bdf, TakesFewStepsWhereTheSystemIsStiff) {
  FirstOrder system = stiff_system();
  const auto bdf = make("bdf", system, 1e-6);
  bdf->start(0.0, std::vector<double>{1.0});
  EXPECT_NEAR(integrate_to(*bdf, 2.0, 1)[0], std::cos(2.0), 1e-5);
  EXPECT_LT(bdf->statistics().steps, 300);

  const auto adams = make("adams", system, 1e-6);
  adams->start(0.0, std::vector<double>{1.0});
  integrate_to(*adams, 0.02, 1);
  EXPECT_GT(adams->statistics().steps, 300) << "functional iteration limits the step to 1e-5";
}

TEST(Bdf, SolvesLargeStiffSystemsWithoutAMatrix) {
  // Heat conduction on n + 1 cells: the slowest mode decays at 4 (n+1)^2 sin^2(pi / (2n+2)), the
  // fastest about n^2 times faster. n is beyond the size that is factorised.
  const int n = 501;
  const double cells = n + 1.0, pi = std::numbers::pi;
  FirstOrder system(n, [&](double, const double* u, double* rate) {
    for (int i = 0; i < n; ++i) {
      const double left = i > 0 ? u[i - 1] : 0.0, right = i + 1 < n ? u[i + 1] : 0.0;
      rate[i] = cells * cells * (left - 2.0 * u[i] + right);
    }
    return true;
  });
  std::vector<double> u0(n);
  for (int i = 0; i < n; ++i) u0[static_cast<std::size_t>(i)] = std::sin(pi * (i + 1) / cells);
  const auto bdf = make("bdf", system, 1e-6);
  bdf->start(0.0, u0);
  const std::vector<double> u = integrate_to(*bdf, 0.1, n);
  const double rate = 4.0 * cells * cells * std::pow(std::sin(0.5 * pi / cells), 2);
  EXPECT_NEAR(u[n / 2], std::exp(-0.1 * rate), 1e-4);
  EXPECT_LT(bdf->statistics().steps, 500);
  EXPECT_LT(bdf->statistics().evaluations, 20000);
}

TEST(Cvode, HonoursMaxStepAndMaxOrder) {
  for (const std::string_view kind : {"adams", "bdf"}) {
    ForcedOscillator system;
    IntegratorOptions options;
    options.max_step = 0.01;
    options.max_order = 2;
    const auto integrator = make_integrator(kind, system, options);
    integrator->start(0.0, ForcedOscillator::initial());
    while (integrator->time() < 1.0) {
      ASSERT_EQ(integrator->step(1.0), Outcome::converged);
      ASSERT_LE(integrator->statistics().last_step, 0.01 * (1 + 1e-12));
      ASSERT_LE(integrator->statistics().last_order, 2);
    }
  }
}

TEST(Cvode, ReachesOrderAboveFiveWithAdams) {
  ForcedOscillator system;
  const auto integrator = make("adams", system, 1e-10);
  integrator->start(0.0, ForcedOscillator::initial());
  int highest = 0;
  while (integrator->time() < 10.0) {
    ASSERT_EQ(integrator->step(10.0), Outcome::converged);
    highest = std::max(highest, integrator->statistics().last_order);
  }
  EXPECT_GT(highest, 5);
  EXPECT_LE(highest, 12);
}

TEST(Cvode, WeighsRelativeAndAbsoluteToleranceApart) {
  // v' = -v falls to 5e-5: relative tolerance keeps its digits, absolute tolerance lets them go.
  FirstOrder system(1, [](double, const double* v, double* rate) {
    rate[0] = -v[0];
    return true;
  });
  const auto error_with = [&](double relative, double absolute) {
    IntegratorOptions options;
    options.relative_tolerance = relative;
    options.absolute_tolerance = absolute;
    const auto integrator = make_integrator("adams", system, options);
    integrator->start(0.0, std::vector<double>{1.0});
    return std::abs(integrate_to(*integrator, 10.0, 1)[0] - std::exp(-10.0));
  };
  const double relative = error_with(1e-6, 1e-14), absolute = error_with(1e-14, 1e-6);
  EXPECT_LT(relative, 1e-4 * std::exp(-10.0));
  EXPECT_LT(absolute, 1e-5);
  EXPECT_GT(absolute, 10.0 * relative);
}

TEST(Cvode, StopsAtASingularityOfTheSolution) {
  // v' = v^2, v(0) = 1 is 1/(1 - t).
  for (const std::string_view kind : {"adams", "bdf"}) {
    FirstOrder system(1, [](double, const double* v, double* rate) {
      rate[0] = v[0] * v[0];
      return true;
    });
    const auto integrator = make(kind, system, 1e-6);
    integrator->start(0.0, std::vector<double>{1.0});
    Outcome outcome = Outcome::converged;
    integrate_to(*integrator, 2.0, 1, &outcome);
    EXPECT_TRUE(outcome == Outcome::step_too_small || outcome == Outcome::not_finite);
    EXPECT_NEAR(integrator->time(), 1.0, 1e-3);
  }
}

TEST(Cvode, GoesOnAfterEvaluationsThatFailOnlyForLargeSteps) {
  // The square root cannot be evaluated where a step overshoots v = 0.
  FirstOrder system(1, [](double, const double* v, double* rate) {
    rate[0] = -std::sqrt(v[0]);
    return v[0] >= 0.0;
  });
  const auto integrator = make("adams", system, 1e-8);
  integrator->start(0.0, std::vector<double>{1.0});
  EXPECT_NEAR(integrate_to(*integrator, 1.9, 1)[0], std::pow(1.0 - 0.5 * 1.9, 2), 1e-6);
}

TEST(CvodeThreads, RunsIndependentIntegratorsAtOnce) {
  std::vector<double> errors(4, 1.0);
  {
    std::vector<std::jthread> threads;
    for (double& error : errors) {
      threads.emplace_back([&error] {
        ForcedOscillator system;
        const auto integrator = make("adams", system, 1e-8);
        integrator->start(0.0, ForcedOscillator::initial());
        error = ForcedOscillator::error(3.0, integrate_to(*integrator, 3.0, 2));
      });
    }
  }
  for (const double error : errors) {
    EXPECT_EQ(error, errors[0]);
    EXPECT_LT(error, 1e-6);
  }
}

}  // namespace
}  // namespace linkwise::test
