// Couplings at a state: their polynomials, and what of them a state misses.
#include <cmath>

#include <gtest/gtest.h>

#include "linkwise/kinematics/coupling_states.hpp"

namespace linkwise::testing {
namespace {

Coupling::Term curve(int at, double factor, std::array<double, 3> higher, bool closes = false) {
  Coupling::Term term{at, 0, at, at, factor};
  std::copy(higher.begin(), higher.end(), term.higher);
  term.closes = closes;
  return term;
}

TEST(CouplingStates, SlopeAndCurvatureAreDerivatives) {
  const Coupling::Term term = curve(0, 0.7, {-0.3, 0.2, 0.45});
  constexpr double h = 1e-4;
  for (const double x : {-1.3, 0.0, 0.8}) {
    EXPECT_NEAR(term.value(x), 0.7 * x - 0.3 * x * x + 0.2 * x * x * x + 0.45 * x * x * x * x,
                1e-14);
    EXPECT_NEAR(term.slope(x), (term.value(x + h) - term.value(x - h)) / (2 * h), 1e-7);
    EXPECT_NEAR(term.curvature(x), (term.slope(x + h) - term.slope(x - h)) / (2 * h), 1e-7);
  }
}

TEST(CouplingStates, MissesAreSumsOverTheTreeAndTheLoops) {
  Coupling coupling{"cam", {curve(0, 1, {}), curve(1, -2, {0.5, 0, 0}, true)}, 0.25};
  const double q[2] = {0.6, 0}, v[2] = {1.5, 0}, loop_q[2] = {0, 0.4}, loop_v[2] = {0, -3};
  const CouplingMiss miss = miss_of(coupling, {q, v, loop_q, loop_v});
  EXPECT_DOUBLE_EQ(miss.gap, 0.6 - 0.8 + 0.5 * 0.16 - 0.25);
  EXPECT_DOUBLE_EQ(miss.slip, 1.5 + (-2 + 0.4) * -3);
  EXPECT_DOUBLE_EQ(miss.bend, 1.0 * 9);
  EXPECT_DOUBLE_EQ(miss_of(coupling, {q, nullptr, loop_q, nullptr}).slip, 0);
}

}  // namespace
}  // namespace linkwise::testing
