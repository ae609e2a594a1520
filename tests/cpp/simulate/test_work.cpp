#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "linkwise/simulate/work.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

TEST(WorkIntegral, IsExactForPolynomials) {
  const auto model = make_model(pendulum());
  for (int nodes = 1; nodes <= WorkIntegral::most_nodes; ++nodes) {
    const int whole = 2 * nodes - 1, part = nodes - 1;
    const auto powers = [&](double t, double* out) {
      out[0] = std::pow(t, whole);
      out[1] = std::pow(t, part);
      out[2] = 1;
      return true;
    };
    const auto exact = [](double t, int degree) { return std::pow(t, degree + 1) / (degree + 1); };
    WorkIntegral work(*model, 1, 0);
    work.add_step(0.5, nodes, 0, powers);
    work.add_step(2, nodes, 0, powers);
    work.reach(1.25);
    EXPECT_NEAR(work.of(0)[1], exact(1.25, part), 1e-12 * exact(2, part)) << nodes;
    EXPECT_NEAR(work.of(0)[2], 1.25, 1e-14);
    work.reach(2);
    EXPECT_NEAR(work.of(0)[0], exact(2, whole), 1e-12 * exact(2, whole)) << nodes;
    EXPECT_NEAR(work.of(0)[1], exact(2, part), 1e-12 * exact(2, part)) << nodes;
  }
}

TEST(WorkIntegral, DoesNotDependOnTheTimesAskedFor) {
  const auto model = make_model(pendulum());
  const auto powers = [](double t, double* out) {
    for (int i = 0; i < 3; ++i) out[i] = std::exp(std::sin((i + 7) * t));
    return true;
  };
  WorkIntegral once(*model, 1, 0), often(*model, 1, 0);
  for (int step = 1; step <= 5; ++step) {
    once.add_step(step, 5, 0, powers);
    often.add_step(step, 5, 0, powers);
    for (double t = step - 0.9; t < step; t += 0.1) often.reach(t);
  }
  once.reach(4.7);
  often.reach(4.7);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(once.of(0)[i], often.of(0)[i]);
}

TEST(WorkIntegral, HalvesStepsUntilTheyAddUp) {
  const auto model = make_model(pendulum());
  const auto powers = [](double t, double* out) {
    for (int i = 0; i < 3; ++i) out[i] = (i + 1) * std::sin(60 * t);
    return true;
  };
  for (const double tolerance : {1e-6, 1e-9, 1e-12}) {
    WorkIntegral work(*model, 1, 0);
    work.add_step(2, 3, tolerance, powers);
    work.reach(2);
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(work.of(0)[i], (i + 1) * (1 - std::cos(120.0)) / 60, 1e2 * tolerance);
  }
}

TEST(WorkIntegral, IsUnknownFromAStepOnThatIsUnknown) {
  const auto model = make_model(pendulum());
  for (const double tolerance : {0.0, 1e-12}) {
    const auto powers = [](double t, double* out) {
      std::fill_n(out, 3, 1.0);
      return t < 1.5 || t > 2;
    };
    WorkIntegral work(*model, 1, 0);
    work.add_step(1, 3, tolerance, powers);
    work.reach(1);
    ASSERT_TRUE(work.known());
    EXPECT_NEAR(work.of(0)[0], 1, 1e-14);
    for (const double end : {2.0, 3.0}) {
      work.add_step(end, 3, tolerance, powers);
      work.reach(end);
      EXPECT_FALSE(work.known());
      EXPECT_EQ(work.of(0), nullptr);
    }
  }
}

}  // namespace
}  // namespace linkwise::testing
