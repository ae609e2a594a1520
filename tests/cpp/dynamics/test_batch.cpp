#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/dynamics/batch.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/forces/armature_bias.hpp"

namespace linkwise::testing {
namespace {

/// Rows of `count` cases one after the other.
struct Rows {
  std::vector<double> q, v, tau, du, external;
  std::vector<DynamicsCase> cases;

  Rows(const Model& model, size_t count) {
    for (size_t i = 0; i < count; ++i) {
      cases.emplace_back(model, 100 + i);
      const DynamicsCase& c = cases.back();
      const auto append = [](std::vector<double>& to, const std::vector<double>& row) {
        to.insert(to.end(), row.begin(), row.end());
      };
      append(q, c.state.q);
      append(v, c.state.v);
      append(tau, c.tau);
      append(du, c.given);
      append(external, c.external);
    }
  }
  BatchInput input() const {
    return {.q = q.data(),
            .v = v.data(),
            .tau = tau.data(),
            .du = du.data(),
            .prescribed = du.data(),
            .external = external.data()};
  }
};

std::vector<double> row(const std::vector<double>& rows, size_t n, size_t i) {
  return {rows.begin() + i * n, rows.begin() + (i + 1) * n};
}

class Batch : public ::testing::TestWithParam<Machine> {};

// From one system to two full groups and one more, by one evaluator that keeps its workspace.
TEST_P(Batch, EqualsOneByOne) {
  const Model model(GetParam().spec);
  const size_t nv = model.nv(), load_width = 6 * model.n_joints();
  BatchEvaluator batch(model);
  DynamicsOptions options;
  options.method = "articulated_body";
  const auto forward = make_dynamics(model, options);
  InverseDynamics<double> inverse(model);
  std::vector<double> one(nv), loads(load_width);
  for (size_t count = 1; count <= 2 * native_lanes + 1; ++count) {
    const Rows rows(model, count);
    // One more of each, to see that nothing is written beyond the end.
    std::vector<double> du(count * nv + 1, 7), w(count * load_width + 1, 7);
    std::vector<double> tau(count * nv + 1, 7), w_inverse(count * load_width + 1, 7);
    EXPECT_EQ(batch.forward_dynamics(count, rows.input(), du.data(), w.data()), -1);
    batch.inverse_dynamics(count, rows.input(), tau.data(), w_inverse.data());
    for (size_t i = 0; i < count; ++i) {
      const DynamicsCase& c = rows.cases[i];
      ASSERT_TRUE(forward->evaluate(0, c.input(), one.data(), loads.data()).ok());
      expect_close(row(du, nv, i), one, 1e-10, "accelerations");
      expect_close(row(w, load_width, i), loads, 1e-10, "loads");
      inverse.evaluate(c.input(), c.given.data(), one.data(), loads.data());
      add_armature_bias(model, c.input().v, 1, one.data());
      expect_close(row(tau, nv, i), one, 1e-13, "torques");
      expect_close(row(w_inverse, load_width, i), loads, 1e-13, "loads of the inverse dynamics");
    }
    for (const auto* array : {&du, &w, &tau, &w_inverse}) EXPECT_EQ(array->back(), 7);
  }
}

TEST_P(Batch, LoadsDoNotChangeTheMotion) {
  const Model model(GetParam().spec);
  const size_t count = native_lanes + 1, nv = model.nv();
  const Rows rows(model, count);
  std::vector<double> with(count * nv), without(count * nv), loads(count * 6 * model.n_joints());
  std::vector<double> only_loads(loads.size());
  BatchEvaluator batch(model);
  batch.forward_dynamics(count, rows.input(), with.data(), loads.data());
  batch.forward_dynamics(count, rows.input(), without.data(), nullptr);
  EXPECT_EQ(with, without);
  batch.inverse_dynamics(count, rows.input(), with.data(), loads.data());
  batch.inverse_dynamics(count, rows.input(), without.data(), nullptr);
  batch.inverse_dynamics(count, rows.input(), nullptr, only_loads.data());
  EXPECT_EQ(with, without);
  EXPECT_EQ(loads, only_loads);
}

TEST_P(Batch, WhatIsAbsentIsZero) {
  const Model model(GetParam().spec);
  const size_t count = native_lanes + 1, nv = model.nv();
  const Rows rows(model, count);
  const std::vector<double> zero(count * nv), no_wrench(count * 6 * model.n_joints());
  BatchEvaluator batch(model);
  std::vector<double> absent(count * nv), zeros(count * nv);
  batch.forward_dynamics(count, {.q = rows.q.data(), .tau = rows.tau.data(), .gravity_factor = 0.5},
                         absent.data(), nullptr);
  batch.forward_dynamics(count,
                         {.q = rows.q.data(),
                          .v = zero.data(),
                          .tau = rows.tau.data(),
                          .prescribed = zero.data(),
                          .external = no_wrench.data(),
                          .gravity_factor = 0.5},
                         zeros.data(), nullptr);
  expect_close(absent, zeros, 1e-14, "accelerations");
  batch.inverse_dynamics(count, {.q = rows.q.data(), .gravity_factor = 0.5}, absent.data(),
                         nullptr);
  batch.inverse_dynamics(count,
                         {.q = rows.q.data(),
                          .v = zero.data(),
                          .du = zero.data(),
                          .external = no_wrench.data(),
                          .gravity_factor = 0.5},
                         zeros.data(), nullptr);
  expect_close(absent, zeros, 1e-14, "torques");
}

class ConstraintForceBatch : public ::testing::TestWithParam<Machine> {};

TEST_P(ConstraintForceBatch, EqualsTheRecursion) {
  const Model model(GetParam().spec);
  const size_t nv = model.nv(), load_width = 6 * model.n_joints(), count = native_lanes + 1;
  BatchEvaluator batch(model);
  const Rows rows(model, count);
  std::vector<double> du(count * nv), w(count * load_width), want_du(count * nv), want_w(w.size());
  EXPECT_EQ(batch.forward_dynamics(count, rows.input(), want_du.data(), want_w.data()), -1);
  EXPECT_EQ(batch.forward_dynamics(count, rows.input(), du.data(), w.data(),
                                   BatchMethod::constraint_force),
            -1);
  for (size_t i = 0; i < count; ++i) {
    expect_close(row(du, nv, i), row(want_du, nv, i), 1e-9, "accelerations");
    expect_close(row(w, load_width, i), row(want_w, load_width, i), 1e-9, "loads");
  }
}

INSTANTIATE_TEST_SUITE_P(Regular, ConstraintForceBatch, ::testing::ValuesIn(regular_machines()),
                         [](const auto& test) { return test.param.name; });
INSTANTIATE_TEST_SUITE_P(Machines, Batch, ::testing::ValuesIn(all_machines()),
                         [](const auto& test) { return test.param.name; });

// A hinge without any inertia about its axis, in one system of a group.
TEST(Batch, TheBodyThatFailsIsNamed) {
  ModelSpec spec;
  spec.links = {{"base", 0, {}, {}}, {"arm", 1, {0.5, 0, 0}, {}}, {"tip", 0, {}, {}}};
  spec.links[2].mass = 1;  // a particle on the hinge's axis
  Draws draws(1);
  for (int i = 0; i < 2; ++i)
    spec.joints.push_back(random_joint(JointType::revolute, "hinge" + std::to_string(i),
                                       spec.links[i].name, spec.links[i + 1].name, draws));
  const Model model(spec);
  for (size_t count : {1, 2, native_lanes, native_lanes + 1}) {
    const Rows rows(model, count);
    std::vector<double> du(2 * count);
    EXPECT_EQ(BatchEvaluator(model).forward_dynamics(count, rows.input(), du.data(), nullptr), 1);
  }
}

}  // namespace
}  // namespace linkwise::testing
