// Which singular positions were passed, told from pivots of the steps.
#include <cmath>

#include <gtest/gtest.h>

#include "linkwise/simulate/coasting.hpp"

namespace linkwise::testing {
namespace {

constexpr int full = 3;

/// Steps of 0.1 whose smallest pivot is (t - singular)^2 + least.
double passed_by(double singular, double least) {
  Coasting coasting;
  coasting.start(full, 1e-6);
  std::vector<double> dv = {1};
  for (double t = 0; t < 1; t += 0.1) {
    LoopReport report;
    report.rows = report.rank = report.strong = full;
    report.smallest_pivot = std::pow(t - singular, 2) + least;
    coasting.steer(t, report, Outcome::converged, {}, dv, true);
    coasting.accepted();
  }
  return coasting.passed();
}

TEST(Coasting, StepsThatJumpOverASingularPositionPassIt) {
  EXPECT_NEAR(passed_by(0.537, 0), 0.537, 1e-6);
  EXPECT_TRUE(std::isnan(passed_by(0.537, 0.01)));
  EXPECT_TRUE(std::isnan(passed_by(1.5, 0)));
}

TEST(Coasting, AStepThatEndsInsideTheWindowPassesIt) {
  Coasting coasting;
  coasting.start(full, 1e-6);
  std::vector<double> dv = {1};
  LoopReport report;
  report.strong = full - 1;
  coasting.steer(0.3, report, Outcome::converged, {}, dv, false);
  coasting.accepted();
  EXPECT_TRUE(std::isnan(coasting.passed()));  // a sample, not a step
  coasting.steer(0.4, report, Outcome::converged, {}, dv, true);
  coasting.accepted();
  EXPECT_EQ(coasting.passed(), 0.4);
}

}  // namespace
}  // namespace linkwise::testing
