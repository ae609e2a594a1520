#include <algorithm>
#include <cmath>
#include <memory>
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
  return make_integrator("esdirk", system, options);
}

TEST(Esdirk, HasOrderFiveAndErrorsProportionalToTheTolerance) {
  std::vector<double> tolerances, steps, at_steps, between_steps;
  for (const double tolerance : {1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10}) {
    ForcedOscillator system;
    const auto integrator = make(system, tolerance);
    integrator->start(0.0, ForcedOscillator::initial());
    double at = 0.0, between = 0.0;
    std::vector<double> y(2);
    while (integrator->time() < 10.0) {
      const double before = integrator->time();
      ASSERT_EQ(integrator->step(10.0), Outcome::converged);
      const double t = integrator->time();
      integrator->interpolate(t, y);
      at = std::max(at, ForcedOscillator::error(t, y));
      for (const double s : {0.2, 0.5, 0.8}) {
        integrator->interpolate(before + s * (t - before), y);
        between = std::max(between, ForcedOscillator::error(before + s * (t - before), y));
      }
    }
    tolerances.push_back(tolerance);
    at_steps.push_back(at);
    between_steps.push_back(between);
    steps.push_back(static_cast<double>(integrator->statistics().steps));
    EXPECT_LT(at, 3 * tolerance) << tolerance;
    EXPECT_LT(between, 60 * tolerance) << tolerance;
  }
  EXPECT_NEAR(log_slope(tolerances, at_steps), 1.0, 0.1);
  EXPECT_NEAR(log_slope(tolerances, between_steps), 1.0, 0.25);
  EXPECT_NEAR(log_slope(steps, at_steps), -5.0, 0.3);
}

/// v' = -1e5 (v - cos t) - sin t, whose solution from v(0) = 1 is cos t.
TEST(Esdirk, TakesFewStepsWhereTheSystemIsStiff) {
  FirstOrder system(1, [](double t, const double* v, double* rate) {
    rate[0] = -1e5 * (v[0] - std::cos(t)) - std::sin(t);
    return true;
  });
  const auto integrator = make(system, 1e-6);
  integrator->start(0.0, std::vector<double>{1.0});
  EXPECT_NEAR(integrate_to(*integrator, 2.0, 1)[0], std::cos(2.0), 1e-5);
  EXPECT_LT(integrator->statistics().steps, 100);
}

/// A row of masses on springs that the system solves itself, and a weak nonlinear one that it does
/// not: q_i'' = -omega_i^2 q_i - 0.5 q_i^3 - q_i', the slow one drives all.
struct StiffRow : OdeSystem {
  explicit StiffRow(bool solves) : solves_(solves) {}
  static constexpr int n = 4;
  static double stiffness(int i) { return std::pow(10.0, 3.0 * i); }
  int size() const override { return 2 * n; }
  int position_size() const override { return n; }
  Outcome evaluate(double, const double* y, double* rate) override {
    for (int i = 0; i < n; ++i) {
      rate[i] = y[n + i];
      rate[n + i] = -stiffness(i) * (y[i] - (i > 0 ? std::sin(y[0]) : 0.0)) -
                    0.5 * y[i] * y[i] * y[i] - 0.1 * y[n + i];
    }
    return Outcome::converged;
  }
  void position_rates(const double*, const double* v, double* qdot) override {
    std::copy_n(v, n, qdot);
  }
  bool solves_stiff_part() const override { return solves_; }
  Outcome factor_stiff_part(double, const double*, double gamma) override {
    gamma_ = gamma;
    ++factors;
    return Outcome::converged;
  }
  void solve_stiff_part(const double* r, double* z) override {
    ++solutions;
    for (int i = 0; i < n; ++i) {
      const double E = gamma_ * 0.1 + gamma_ * gamma_ * stiffness(i);
      z[n + i] = r[n + i] - (E * r[n + i] + gamma_ * stiffness(i) * r[i]) / (1 + E);
      z[i] = r[i] + gamma_ * z[n + i];
    }
  }
  static std::vector<double> initial() {
    std::vector<double> y(2 * n, 0.0);
    y[0] = 0.3;
    for (int i = 1; i < n; ++i) y[i] = std::sin(0.3);
    return y;
  }
  bool solves_;
  double gamma_ = 0.0;
  long factors = 0, solutions = 0;
};

TEST(Esdirk, TakesTheStiffPartFromTheSystem) {
  StiffRow own(true), plain(false);
  const auto by_system = make(own, 1e-8), by_differences = make(plain, 1e-8);
  by_system->start(0.0, StiffRow::initial());
  by_differences->start(0.0, StiffRow::initial());
  const std::vector<double> got = integrate_to(*by_system, 5.0, own.size()),
                            want = integrate_to(*by_differences, 5.0, own.size());
  for (int i = 0; i < own.size(); ++i) EXPECT_NEAR(got[i], want[i], 1e-5) << i;
  EXPECT_GT(own.factors, 0);
  EXPECT_GT(own.solutions, own.factors);
  EXPECT_EQ(plain.factors, 0);
}

TEST(Esdirk, StaysOnConstraintsAndKeepsItsAccuracy) {
  for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
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
      }
    }
    integrator->interpolate(10.0, y);
    EXPECT_LT(CartesianPendulum::error_at_10(y), 300 * tolerance);
  }
}

TEST(Esdirk, GoesOnAfterEvaluationsThatFailOnlyForLargeSteps) {
  FirstOrder system(1, [](double, const double* v, double* rate) {
    rate[0] = -std::sqrt(v[0]);
    return v[0] >= 0.0;
  });
  const auto integrator = make(system, 1e-8);
  integrator->start(0.0, std::vector<double>{1.0});
  EXPECT_NEAR(integrate_to(*integrator, 1.9, 1)[0], std::pow(1.0 - 0.5 * 1.9, 2), 1e-6);
}

TEST(Esdirk, FollowsTurnsBetweenSteps) {
  // A quaternion about z by 3 t, at samples within steps.
  SpinningBody system;
  const auto integrator = make(system, 1e-8);
  integrator->start(0.0, SpinningBody::initial(3.0));
  std::vector<double> y(7);
  while (integrator->time() < 5.0) {
    const double before = integrator->time();
    ASSERT_EQ(integrator->step(5.0), Outcome::converged);
    for (const double s : {0.2, 0.5, 0.9}) {
      const double t = before + s * (integrator->time() - before);
      integrator->interpolate(t, y);
      EXPECT_NEAR(y[2], std::sin(1.5 * t), 1e-6);
      EXPECT_NEAR(y[3], std::cos(1.5 * t), 1e-6);
    }
  }
}

TEST(Esdirk, StopsAtASingularityOfTheSolution) {
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
