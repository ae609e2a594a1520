#include <cmath>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "integrate/closed_form_systems.hpp"
#include "linkwise/integrate/integrator.hpp"

namespace linkwise::test {
namespace {

std::unique_ptr<Integrator> make(std::string_view kind, OdeSystem& system, double step) {
  IntegratorOptions options;
  options.step = step;
  return make_integrator(kind, system, options);
}

double order_at(std::string_view kind, double s) {
  return convergence_order(
      {0.04, 0.02, 0.01, 0.005}, 2.0, s,
      [kind](OdeSystem& system, double step) { return make(kind, system, step); });
}

TEST(RungeKutta4, HasOrderFourAtAndBetweenSteps) {
  for (const double s : {1.0, 0.5, 0.3}) {
    EXPECT_NEAR(order_at("runge_kutta_4", s), 4.0, 0.1) << s;
  }
}

TEST(RungeKutta4, EvaluatesFourTimesAStep) {
  ForcedOscillator system;
  const auto integrator = make("runge_kutta_4", system, 0.1);
  integrator->start(0.0, ForcedOscillator::initial());
  for (int i = 0; i < 10; ++i) ASSERT_EQ(integrator->step(1.0), Outcome::converged);
  EXPECT_EQ(integrator->statistics().evaluations, 4 * 10 + 1);
}

TEST(RungeKutta4, IsExactForPolynomialsOfDegreeFour) {
  FirstOrder system(1, [](double t, const double*, double* rate) {
    rate[0] = 4.0 * t * t * t;
    return true;
  });
  const auto integrator = make("runge_kutta_4", system, 0.5);
  integrator->start(0.0, std::vector<double>{1.0});
  for (int i = 0; i < 4; ++i) ASSERT_EQ(integrator->step(2.0), Outcome::converged);
  std::vector<double> y(1);
  integrator->interpolate(2.0, y);
  EXPECT_DOUBLE_EQ(y[0], 17.0);
}

TEST(SemiImplicitEuler, HasOrderOneAtAndBetweenSteps) {
  for (const double s : {1.0, 0.5}) {
    EXPECT_NEAR(order_at("semi_implicit_euler", s), 1.0, 0.1) << s;
  }
}

TEST(SemiImplicitEuler, ConservesTheModifiedEnergyOfAnOscillator) {
  // Of q'' = -q, semi-implicit Euler conserves q^2 + v^2 - h q v exactly [hairer2006, I.2].
  struct Oscillator : ForcedOscillator {
    Outcome evaluate(double, const double* y, double* ydot) override {
      ydot[0] = y[1];
      ydot[1] = -y[0];
      return Outcome::converged;
    }
  } system;
  const double h = 0.1;
  const auto integrator = make("semi_implicit_euler", system, h);
  integrator->start(0.0, std::vector<double>{1.0, 0.0});
  std::vector<double> y(2);
  for (int i = 0; i < 10000; ++i) {
    ASSERT_EQ(integrator->step(1e9), Outcome::converged);
    integrator->interpolate(integrator->time(), y);
    ASSERT_NEAR(y[0] * y[0] + y[1] * y[1] - h * y[0] * y[1], 1.0, 1e-12);
  }
}

TEST(FixedStep, StaysOnConstraints) {
  for (const std::string_view kind : {"runge_kutta_4", "semi_implicit_euler"}) {
    std::vector<double> y(4);
    double drift[2] = {};
    for (const bool projects : {false, true}) {
      CartesianPendulum system(projects);
      const auto integrator = make(kind, system, 0.01);
      integrator->start(0.0, CartesianPendulum::initial());
      for (int k = 1; k <= 1000; ++k) {
        ASSERT_EQ(integrator->step(1e9), Outcome::converged);
        for (const double t : {0.01 * k, 0.01 * k - 0.005}) {
          integrator->interpolate(t, y);
          drift[projects] = std::max(drift[projects], CartesianPendulum::drift(y));
        }
      }
    }
    EXPECT_LT(drift[1], 1e-14) << kind;
    EXPECT_GT(drift[0], 1e-6) << kind;
  }
}

TEST(FixedStep, StaysOnTheGridOfTheStart) {
  ForcedOscillator system;
  const auto integrator = make("semi_implicit_euler", system, 0.1);
  integrator->start(2.0, ForcedOscillator::initial());
  for (int i = 1; i <= 100000; ++i) {
    ASSERT_EQ(integrator->step(1e9), Outcome::converged);
    ASSERT_EQ(integrator->time(), 2.0 + i * 0.1);
  }
}

TEST(FixedStep, RefusesAStepThatRoundOffSwallows) {
  ForcedOscillator system;
  const auto integrator = make("runge_kutta_4", system, 1e-9);
  integrator->start(1e9, ForcedOscillator::initial());
  EXPECT_EQ(integrator->step(2e9), Outcome::step_too_small);
}

}  // namespace
}  // namespace linkwise::test
