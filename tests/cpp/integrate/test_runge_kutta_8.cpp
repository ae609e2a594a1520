#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "integrate/closed_form_systems.hpp"
#include "linkwise/integrate/integrator.hpp"

namespace linkwise::test {
namespace {

std::unique_ptr<Integrator> make(OdeSystem& system, double tolerance, double max_step = 0.0) {
  IntegratorOptions options;
  options.tolerance = tolerance;
  options.max_step = max_step;
  return make_integrator("runge_kutta_8", system, options);
}

double order_at(double s) {
  return convergence_order({0.3, 0.2, 0.15, 0.1}, 3.0, s,
                           [](OdeSystem& system, double step) { return make(system, 1e6, step); });
}

TEST(RungeKutta8, HasOrderEightAtAndSevenBetweenSteps) {
  EXPECT_NEAR(order_at(1.0), 8.0, 0.4);
  for (const double s : {0.25, 0.5, 0.8}) EXPECT_GT(order_at(s), 7.0) << s;
}

TEST(RungeKutta8, StaysOnConstraintsAndKeepsItsAccuracy) {
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10, 1e-12}) {
    CartesianPendulum system(true);
    const auto integrator = make(system, tolerance);
    integrator->start(0.0, CartesianPendulum::initial());
    std::vector<double> y(4);
    while (integrator->time() < 10.0) {
      const double before = integrator->time();
      ASSERT_EQ(integrator->step(10.0), Outcome::converged);
      for (const double s : {0.3, 1.0}) {
        integrator->interpolate(before + s * (integrator->time() - before), y);
        EXPECT_LT(CartesianPendulum::drift(y), 1e-14);
        EXPECT_LT(std::abs(CartesianPendulum::energy(y)), 300 * tolerance);
      }
    }
    integrator->interpolate(10.0, y);
    EXPECT_LT(CartesianPendulum::error_at_10(y), 300 * tolerance);
  }
}

TEST(RungeKutta8, GoesOnAfterEvaluationsThatFailOnlyForLargeSteps) {
  FirstOrder system(1, [](double, const double* v, double* rate) {
    rate[0] = -std::sqrt(v[0]);
    return v[0] >= 0.0;
  });
  const auto integrator = make(system, 1e-8);
  integrator->start(0.0, std::vector<double>{1.0});
  EXPECT_NEAR(integrate_to(*integrator, 1.9, 1)[0], std::pow(1.0 - 0.5 * 1.9, 2), 1e-6);
}

TEST(RungeKutta8, StopsAtASingularityOfTheSolution) {
  FirstOrder system(1, [](double, const double* v, double* rate) {
    rate[0] = v[0] * v[0];
    return true;
  });
  const auto integrator = make(system, 1e-6);
  integrator->start(0.0, std::vector<double>{1.0});
  Outcome outcome = Outcome::converged;
  integrate_to(*integrator, 2.0, 1, &outcome);
  EXPECT_TRUE(outcome == Outcome::step_too_small || outcome == Outcome::not_finite);
  EXPECT_NEAR(integrator->time(), 1.0, 1e-3);
}

}  // namespace
}  // namespace linkwise::test
