#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "dynamics/looped_machine.hpp"
#include "linkwise/simulate/extremes.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

constexpr double let_go = 1.5;

std::vector<double> extremes_until(double end, int samples, SimulationOptions options) {
  Simulation simulation(make_model(pendulum()), std::move(options));
  simulation.keep_extremes({0, 1, 0});
  const double q = let_go, v = 0;
  simulation.start(0, {&q, &v});
  for (int k = 1; k <= samples; ++k) EXPECT_TRUE(simulation.advance(end * k / samples, Sample()));
  return simulation.extremes();
}

// Of a pendulum let go at an angle a, the rod carries m g (3 - 2 cos a) at the bottom.
TEST(Extremes, AreFoundBetweenSamples) {
  const auto model = make_model(pendulum());
  const size_t states = 2 * Extremes::state_size(*model);
  const size_t width = (Extremes::size(*model) - 12 * Extremes::n_derived - states) / 6;
  const double bottom = 9.81 * (3 - 2 * std::cos(let_go));
  for (const std::string_view kind : all_kinds()) {
    const auto found = extremes_until(2, 1, fixed_step(1e-2, kind));
    ASSERT_EQ(found.size(), Extremes::size(*model));
    const double* maximum = found.data() + 3 * width;
    const double room = kind == "semi_implicit_euler" ? 0.05 * bottom : 1e-3 * bottom;
    EXPECT_NEAR(maximum[Extremes::force], bottom, room) << kind;
    EXPECT_NEAR(maximum[Extremes::radial], bottom, room) << kind;
    EXPECT_NEAR(maximum[Extremes::axial], 0, 1e-9) << kind;
    EXPECT_GE(maximum[2 * width], maximum[0]) << kind;  // its reach
    const double* position = found.data() + 13;
    EXPECT_LT(position[0], -0.8 * let_go) << kind;
    const double* state = found.data() + found.size() - states;  // when the force was largest
    EXPECT_NEAR(state[0], 0, 0.05) << kind;
    EXPECT_NEAR(std::abs(state[1]), std::abs(maximum[position - found.data() + 1]), room) << kind;
  }
}

TEST(Extremes, DoNotDependOnTheTimesAskedFor) {
  for (const std::string_view kind : all_kinds()) {
    const auto once = extremes_until(2, 1, fixed_step(1e-2, kind));
    const auto often = extremes_until(2, 777, fixed_step(1e-2, kind));
    for (size_t i = 0; i < once.size(); ++i) EXPECT_EQ(once[i], often[i]) << kind << ' ' << i;
  }
}

// Each state between steps is that of a sample: found by few samples and by many.
TEST(Extremes, OfClosedLoopsAreThoseOfDenseSamples) {
  const auto model = make_model(row_of_four_bars(2));
  const size_t joints = model->n_loads();
  const std::vector<double> directions(3 * joints, 0.0);
  std::vector<double> q(model->nq()), v(model->nv());
  q[0] = 0.3;
  Simulation seldom(model, fixed_step(1e-2)), often(model, fixed_step(1e-2));
  seldom.keep_extremes(directions);
  seldom.start(0, {q.data(), v.data()});
  ASSERT_TRUE(seldom.advance(0.4, Sample()));
  const std::vector<double> found = seldom.extremes();
  ASSERT_EQ(found.size(), Extremes::size(*model));
  often.start(0, {q.data(), v.data()});
  std::vector<double> load(6 * joints), largest(joints);
  Sample sample;
  sample["joint_load"] = load.data();
  for (int k = 0; k <= 400; ++k) {
    ASSERT_TRUE(often.advance(1e-3 * k, sample));
    for (size_t j = 0; j < joints; ++j)
      largest[j] = std::max(largest[j], std::hypot(load[6 * j], load[6 * j + 1], load[6 * j + 2]));
  }
  const size_t states = 2 * joints * Extremes::state_size(*model);
  const size_t width = (found.size() - 12 * Extremes::n_derived * joints - states) / 6;
  for (size_t j = 0; j < joints; ++j) {
    EXPECT_NEAR(found[3 * width + j], largest[j], 1e-3 * largest[j]) << j;
    EXPECT_TRUE(std::isfinite(found[5 * width + j])) << j;  // its bound
  }
  EXPECT_EQ(seldom.loop_doubt(), "");
}

}  // namespace
}  // namespace linkwise::testing
