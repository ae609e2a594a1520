#pragma once
// One evaluation of a machine: everything that acts on it, and the twin's answer.

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "kinematics/world_twin.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/dynamics/piecewise.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {

struct DynamicsCase {
  MachineState state;
  std::vector<double> tau, given /*accelerations of prescribed joints*/, external;

  DynamicsCase(const Model& model, std::uint64_t seed) {
    Draws draws(seed);
    state = random_state(model, draws);
    tau = random_values(model.nv(), draws, 5);
    given = random_values(model.nv(), draws);
    external = random_values(6 * model.n_joints(), draws, 3);
    for (int j = 0; j < model.n_joints(); ++j)  // no wrench acts on a link without mass
      if (!model.joints[j].last_of_body)
        for (int i = 0; i < 6; ++i) external[6 * j + i] = 0;
  }
  SweepInput<double> input() const {
    SweepInput<double> in;
    in.q = state.q.data();
    in.v = state.v.data();
    in.tau = tau.data();
    in.prescribed = given.data();
    in.external = external.data();
    return in;
  }
};

/// Does the method take the model? Every method takes every model, except for the pairs named here,
/// for which it must throw an InputError.
inline bool takes(const DynamicsEntry& entry, const Model& model) {
  const bool expected = entry.name == "constraint_force" ? model.singular_body() < 0
                        : entry.name == "piecewise"      ? Piecewise::suits(model)
                                                         : true;
  DynamicsOptions options;
  options.method = entry.name;
  if (expected)
    EXPECT_NO_THROW(make_dynamics(model, options)) << entry.name;
  else
    EXPECT_THROW(make_dynamics(model, options), InputError) << entry.name;
  return expected;
}

struct Motion6 {
  std::vector<double> du, loads;
};
inline Motion6 evaluate(DynamicsMethod& method, const Model& model, const SweepInput<double>& in) {
  Motion6 out{std::vector<double>(model.nv(), NAN), std::vector<double>(6 * model.n_joints(), NAN)};
  const DynamicsReport report = method.evaluate(0, in, out.du.data(), out.loads.data());
  EXPECT_TRUE(report.ok()) << to_string(report.outcome);
  return out;
}

/// All within `tolerance` of the largest.
inline void expect_close(const std::vector<double>& got, const std::vector<double>& want,
                         double tolerance, const std::string& what) {
  ASSERT_EQ(got.size(), want.size()) << what;
  double scale = 1, worst = 0;
  size_t at = 0;
  for (size_t i = 0; i < want.size(); ++i) {
    scale = std::max(scale, std::abs(want[i]));
    if (!(std::abs(got[i] - want[i]) <= worst)) {
      worst = std::abs(got[i] - want[i]);
      at = i;
    }
  }
  EXPECT_LE(worst, tolerance * scale) << what << " [" << at << "] of " << got.size();
}

}  // namespace linkwise::testing
