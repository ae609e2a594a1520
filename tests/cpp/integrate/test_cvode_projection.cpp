#include <cmath>
#include <string_view>
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

/// y' = 0, and every projection adds 1.
struct Shifted : FirstOrder {
  Shifted()
      : FirstOrder(1, [](double, const double*, double* ydot) {
          ydot[0] = 0.0;
          return true;
        }) {}
  bool constrained() const override { return true; }
  Outcome project(double, double* y) override {
    y[0] += 1.0;
    return Outcome::converged;
  }
};

TEST(CvodeProjection, StepsOfAdamsBeginAtTheProjectedState) {
  // What CVODE does with the state that is written into its history is not documented.
  Shifted system;
  const auto adams = make("adams", system, 1e-6);
  adams->start(0.0, std::vector<double>{0.0});
  std::vector<double> y(1);
  for (int k = 1; k <= 30; ++k) {
    ASSERT_EQ(adams->step(1e9), Outcome::converged);
    adams->interpolate(adams->time(), y);
    ASSERT_EQ(y[0], k + 1.0);  // and one at the start
  }
}

struct Pendulum {
  double error = 0, drift = 0, energy = 0;
  long steps = 0;
};

Pendulum swing(std::string_view kind, double tolerance, bool projects) {
  CartesianPendulum system(projects);
  const auto integrator = make(kind, system, tolerance);
  integrator->start(0.0, CartesianPendulum::initial());
  Pendulum result;
  std::vector<double> y(4);
  const auto measure = [&](double t) {
    integrator->interpolate(t, y);
    result.drift = std::max(result.drift, CartesianPendulum::drift(y));
    result.energy = std::max(result.energy, std::abs(CartesianPendulum::energy(y)));
  };
  while (integrator->time() < 10.0) {
    const double before = integrator->time();
    EXPECT_EQ(integrator->step(10.0), Outcome::converged);
    if (integrator->time() >= 10.0) break;
    measure(integrator->time());
    measure(0.5 * (before + integrator->time()));
  }
  integrator->interpolate(10.0, y);
  result.error = CartesianPendulum::error_at_10(y);
  result.steps = integrator->statistics().steps;
  return result;
}

/// Bounds are multiples of the tolerance; an error without projection may be smaller by chance.
void expect_accuracy(std::string_view kind, std::vector<double> tolerances, double error) {
  for (const double tolerance : tolerances) {
    const Pendulum on = swing(kind, tolerance, true), off = swing(kind, tolerance, false);
    EXPECT_LT(on.drift, 1e-14) << tolerance;
    EXPECT_GT(off.drift, 10 * tolerance) << tolerance;
    EXPECT_LT(on.error, error * tolerance);
    EXPECT_LT(on.energy, error * tolerance);
    EXPECT_LT(on.error, 2 * off.error) << tolerance;
    EXPECT_LT(on.steps, 1.2 * off.steps) << tolerance;
  }
}

TEST(CvodeProjection, AdamsStaysOnConstraintsAndKeepsItsAccuracy) {
  expect_accuracy("adams", {1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11}, 1000);
}

TEST(CvodeProjection, BdfStaysOnConstraintsAndKeepsItsAccuracy) {
  expect_accuracy("bdf", {1e-5, 1e-6, 1e-7, 1e-8, 1e-9}, 20000);
}

TEST(CvodeProjection, BdfTakesNoMoreStepsForASpinningQuaternion) {
  struct Free : SpinningBody {
    bool constrained() const override { return false; }
    Outcome project(double, double*) override { return Outcome::converged; }
  } free;
  SpinningBody projected;
  long steps[2];
  for (OdeSystem* system : {static_cast<OdeSystem*>(&free), static_cast<OdeSystem*>(&projected)}) {
    const auto bdf = make("bdf", *system, 1e-8);
    bdf->start(0.0, SpinningBody::initial(3.0));
    const std::vector<double> y = integrate_to(*bdf, 10.0, 7);
    EXPECT_NEAR(y[2], std::sin(15.0), 1e-5);
    steps[system == &projected] = bdf->statistics().steps;
  }
  EXPECT_LT(steps[1], 1.1 * steps[0]);
}

TEST(CvodeProjection, StatesThatCannotBeProjectedEndTheMotion) {
  struct Torn : CartesianPendulum {
    Torn() : CartesianPendulum(true) {}
    Outcome project(double t, double* y) override {
      return t > 1.0 ? Outcome::not_finite : CartesianPendulum::project(t, y);
    }
  };
  for (const std::string_view kind : {"adams", "bdf", "runge_kutta_4", "semi_implicit_euler"}) {
    Torn system;
    IntegratorOptions options;
    if (find_integrator(kind).fixed_step) options.step = 1e-3;
    const auto integrator = make_integrator(kind, system, options);
    integrator->start(0.0, CartesianPendulum::initial());
    Outcome outcome = Outcome::converged;
    const std::vector<double> y = integrate_to(*integrator, 2.0, 4, &outcome);
    EXPECT_EQ(outcome, Outcome::not_finite) << kind;
    EXPECT_LE(integrator->time(), 1.0) << kind;
    EXPECT_LT(CartesianPendulum::drift(y), 1e-14) << kind;
  }
}

}  // namespace
}  // namespace linkwise::test
