#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "integrate/closed_form_systems.hpp"
#include "linkwise/integrate/integrator.hpp"

namespace linkwise {

/// What `auto` and `adams` step with, without anything that looks for stiffness.
std::unique_ptr<Integrator> make_plain_adams(OdeSystem&, const IntegratorOptions&);

}  // namespace linkwise

namespace linkwise::test {
namespace {

IntegratorOptions at(double tolerance) {
  IntegratorOptions options;
  options.tolerance = tolerance;
  return options;
}

/// v_i' = -rate(t) (v_i - cos t) - sin t, whose solution from v(0) = 1 is cos t.
FirstOrder cosines(std::function<double(double)> rate_at, int n = 1) {
  return FirstOrder(n, [rate_at, n](double t, const double* v, double* rate) {
    const double steep = rate_at(t), cos = std::cos(t), sin = std::sin(t);
    for (int i = 0; i < n; ++i) rate[i] = -steep * (v[i] - cos) - sin;
    return true;
  });
}

FirstOrder cosine(double rate) {
  return cosines([rate](double) { return rate; });
}

/// Evaluations of either kind, and the latest time of those aside.
struct Counted : ForcedOscillator {
  Outcome evaluate(double t, const double* y, double* ydot) override {
    ++on_the_way;
    return ForcedOscillator::evaluate(t, y, ydot);
  }
  Outcome evaluate_aside(double t, const double* y, double* ydot) override {
    ++aside;
    EXPECT_LE(t, reached) << "looks stay in what was covered";
    return ForcedOscillator::evaluate(t, y, ydot);
  }
  void accepted(double t, const double*) override { reached = t; }

  long on_the_way = 0, aside = 0;
  double reached = 0.0;
};

TEST(Auto, IsAdamsToTheLastBitWhereNothingIsStiff) {
  for (const std::string_view kind : {"auto", "adams"}) {
    Counted system;
    ForcedOscillator twin;
    const auto integrator = make_integrator(kind, system, at(1e-8));
    const auto plain = make_plain_adams(twin, at(1e-8));
    integrator->start(0.0, ForcedOscillator::initial());
    plain->start(0.0, ForcedOscillator::initial());
    std::vector<double> y(2), y_plain(2);
    while (plain->time() < 5000.0) {
      ASSERT_EQ(plain->step(1e9), Outcome::converged);
      ASSERT_EQ(integrator->step(1e9), Outcome::converged);
      plain->interpolate(plain->time(), y_plain);
      integrator->interpolate(integrator->time(), y);
      ASSERT_EQ(y, y_plain) << plain->time();
    }
    EXPECT_GT(system.aside, 0);
    EXPECT_EQ(integrator->stiffness(), "");
    EXPECT_EQ(integrator->statistics().steps, plain->statistics().steps);
    EXPECT_EQ(integrator->statistics().evaluations, system.on_the_way + system.aside);
    EXPECT_EQ(system.on_the_way, plain->statistics().evaluations);
    EXPECT_LT(static_cast<double>(system.aside), 0.02 * static_cast<double>(system.on_the_way));
  }
}

TEST(Auto, GoesOnWithBdfWhereTheSystemIsStiff) {
  for (const double rate : {1e3, 1e5, 1e7, 1e9, 1e11}) {
    FirstOrder system = cosine(rate);
    const auto integrator = make_integrator("auto", system, at(1e-6));
    integrator->start(0.0, std::vector<double>{1.0});
    EXPECT_NEAR(integrate_to(*integrator, 20.0, 1)[0], std::cos(20.0), 1e-5) << rate;
    EXPECT_LT(integrator->statistics().evaluations, 12000) << rate;
    EXPECT_LE(integrator->statistics().last_order, 5) << rate;
    EXPECT_EQ(integrator->stiffness().find("stiff from t = "), 0) << integrator->stiffness();
    EXPECT_NE(integrator->stiffness().find("bdf took over"), std::string::npos);
    EXPECT_TRUE(std::is_sorted(system.accepted_times.begin(), system.accepted_times.end()));
  }
}

TEST(Auto, BeginsAnewWithAdams) {
  FirstOrder system = cosine(1e5);
  const auto integrator = make_integrator("auto", system, at(1e-6));
  integrator->start(0.0, std::vector<double>{1.0});
  const std::vector<double> first = integrate_to(*integrator, 5.0, 1);
  const IntegratorStatistics counted = integrator->statistics();
  const std::string said = integrator->stiffness();
  integrator->start(0.0, std::vector<double>{1.0});
  EXPECT_EQ(integrator->stiffness(), "");
  EXPECT_EQ(integrate_to(*integrator, 5.0, 1), first);
  EXPECT_EQ(integrator->statistics().steps, counted.steps);
  EXPECT_EQ(integrator->statistics().evaluations, counted.evaluations);
  EXPECT_EQ(integrator->stiffness(), said);
}

/// Stiff until t = 10.
double stiff_at_first(double t) { return t < 10.0 ? 1e5 : 1e-3; }

TEST(Auto, GoesBackToAdamsWhereTheMotionIsStiffNoMore) {
  FirstOrder system = cosines(stiff_at_first);
  const auto integrator = make_integrator("auto", system, at(1e-8));
  integrator->start(0.0, std::vector<double>{1.0});
  EXPECT_NEAR(integrate_to(*integrator, 9.0, 1)[0], std::cos(9.0), 1e-7);
  EXPECT_LE(integrator->statistics().last_order, 5);
  EXPECT_NEAR(integrate_to(*integrator, 500.0, 1)[0], std::cos(500.0), 1e-4);
  EXPECT_GT(integrator->statistics().last_order, 5);
  EXPECT_NE(integrator->stiffness().find("took turns, 2 changes"), std::string::npos)
      << integrator->stiffness();
}

TEST(Auto, FindsStiffnessThatComesLate) {
  FirstOrder system = cosines([](double t) { return t < 300.0 ? 1e-3 : 1e6; });
  const auto integrator = make_integrator("auto", system, at(1e-8));
  integrator->start(0.0, std::vector<double>{1.0});
  EXPECT_NEAR(integrate_to(*integrator, 400.0, 1)[0], std::cos(400.0), 1e-6);
  EXPECT_LT(integrator->statistics().evaluations, 100000);
  EXPECT_EQ(integrator->stiffness().find("stiff from t = 300"), 0) << integrator->stiffness();
}

TEST(Auto, CountsTheStepsOfBothMethodsAgainstTheirMaximum) {
  FirstOrder system = cosine(1e6);
  IntegratorOptions options = at(1e-6);
  options.max_steps = 5000;
  const auto integrator = make_integrator("auto", system, options);
  integrator->start(0.0, std::vector<double>{1.0});
  Outcome outcome = Outcome::converged;
  integrate_to(*integrator, 1e6, 1, &outcome);
  EXPECT_EQ(outcome, Outcome::too_many_steps);
  EXPECT_EQ(integrator->statistics().steps, 5000);
  EXPECT_NE(integrator->stiffness(), "");
}

TEST(Auto, GivesBothMethodsTheOrderThatTheyTake) {
  FirstOrder system = cosine(1e6);
  IntegratorOptions options = at(1e-6);
  for (const int order : {2, 12}) {
    options.max_order = order;
    const auto integrator = make_integrator("auto", system, options);
    integrator->start(0.0, std::vector<double>{1.0});
    EXPECT_NEAR(integrate_to(*integrator, 2.0, 1)[0], std::cos(2.0), 1e-4);
    EXPECT_NE(integrator->stiffness(), "");
  }
}

/// Where stiffness of this rate begins at once, no step of adams is small enough.
TEST(Auto, GoesOnWithBdfWhereAdamsFindsNoStep) {
  const auto jump = [](double t) { return t < 1.0 ? 1.0 : 1e17; };
  FirstOrder system = cosines(jump), twin = cosines(jump);
  const auto adams = make_integrator("adams", twin, at(1e-6));
  adams->start(0.0, std::vector<double>{1.0});
  Outcome outcome = Outcome::converged;
  integrate_to(*adams, 2.0, 1, &outcome);
  EXPECT_EQ(outcome, Outcome::step_too_small);
  const auto integrator = make_integrator("auto", system, at(1e-6));
  integrator->start(0.0, std::vector<double>{1.0});
  EXPECT_NEAR(integrate_to(*integrator, 2.0, 1, &outcome)[0], std::cos(2.0), 1e-5);
  EXPECT_EQ(outcome, Outcome::converged);
  EXPECT_NE(integrator->stiffness().find("no step small enough"), std::string::npos)
      << integrator->stiffness();
}

TEST(Adams, SaysWhatBdfWouldSaveAndDoesNotChange) {
  FirstOrder system = cosine(1e5), twin = cosine(1e5);
  const auto adams = make_integrator("adams", system, at(1e-6));
  const auto plain = make_plain_adams(twin, at(1e-6));
  adams->start(0.0, std::vector<double>{1.0});
  plain->start(0.0, std::vector<double>{1.0});
  EXPECT_EQ(integrate_to(*adams, 0.2, 1), integrate_to(*plain, 0.2, 1));
  EXPECT_EQ(adams->statistics().steps, plain->statistics().steps);
  EXPECT_EQ(adams->stiffness().find("stiff at t = "), 0) << adams->stiffness();
  EXPECT_NE(adams->stiffness().find("integrator = \"auto\""), std::string::npos);
}

/// Many unknowns, and a rate that is only a few times above what accuracy needs.
TEST(Auto, SaysThatAMotionIsStiffWhereBdfCostsMore) {
  FirstOrder system = cosines([](double) { return 100.0; }, 200);
  const auto integrator = make_integrator("auto", system, at(1e-6));
  integrator->start(0.0, std::vector<double>(200, 1.0));
  while (integrator->stiffness().empty() && integrator->time() < 20000.0)
    ASSERT_EQ(integrator->step(1e9), Outcome::converged);
  EXPECT_NE(integrator->stiffness().find("bdf costs more"), std::string::npos)
      << integrator->stiffness() << integrator->time() << " "
      << integrator->statistics().evaluations;
  EXPECT_GT(integrator->statistics().last_step, 0.0);
}

}  // namespace
}  // namespace linkwise::test
