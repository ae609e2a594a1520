#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/constraint_elimination.hpp"
#include "linkwise/dynamics/constraint_force.hpp"

namespace linkwise::testing {
namespace {

std::vector<Machine> machines_to_eliminate() {
  std::vector<Machine> all = regular_machines();
  for (Machine& machine : one_axis_machines()) all.push_back(std::move(machine));
  return all;
}

class Eliminations : public ::testing::TestWithParam<Machine> {};

// The slow twin assembles A as a whole and hands it to the solver of the table.
TEST_P(Eliminations, EqualTheAssembledSystem) {
  const Model model(GetParam().spec);
  DynamicsOptions options;
  options.solver = "thomas";
  ConstraintForce plain(model, options);
  ConstraintElimination<double> fused(model);
  for (int seed = 51; seed < 54; ++seed) {
    const DynamicsCase c(model, seed);
    const Motion6 want = evaluate(plain, model, c.input());
    std::vector<double> du(model.nv(), NAN), loads(6 * model.n_joints(), NAN),
        f(fused.n_unknowns(), NAN);
    ASSERT_TRUE(fused.evaluate(c.input(), du.data(), loads.data(), f.data()));
    expect_close(du, want.du, 1e-10, "accelerations");
    expect_close(loads, want.loads, 1e-10, "loads");
    const auto forces = plain.constraint_force();
    expect_close(f, {forces.begin(), forces.end()}, 1e-9, "forces");
    std::vector<double> again(model.nv(), NAN);
    ASSERT_TRUE(fused.evaluate(c.input(), again.data(), nullptr));
    expect_close(again, du, 1e-15, "without loads");
  }
}

TEST_P(Eliminations, EqualTheRecursion) {
  const Model model(GetParam().spec);
  ArticulatedBody<double> recursion(model);
  ConstraintElimination<double> fused(model);
  const DynamicsCase c(model, 55);
  std::vector<double> want(model.nv()), want_loads(6 * model.n_joints()), du(want),
      loads(want_loads);
  ASSERT_TRUE(recursion.evaluate(c.input(), want.data(), want_loads.data()));
  ASSERT_TRUE(fused.evaluate(c.input(), du.data(), loads.data()));
  expect_close(du, want, 1e-10, "accelerations");
  expect_close(loads, want_loads, 1e-10, "loads");
}

TEST_P(Eliminations, OnLanesEqualOneByOne) {
  using Group = Lanes<native_lanes>;
  const Model model(GetParam().spec);
  std::vector<DynamicsCase> cases;
  for (int l = 0; l < native_lanes; ++l) cases.emplace_back(model, 60 + l);
  const auto pack = [&](auto&& of) {
    std::vector<Group> out(of(cases[0]).size());
    for (size_t i = 0; i < out.size(); ++i)
      for (int l = 0; l < native_lanes; ++l) out[i][l] = of(cases[l])[i];
    return out;
  };
  const auto q = pack([](const auto& c) { return c.state.q; });
  const auto v = pack([](const auto& c) { return c.state.v; });
  const auto tau = pack([](const auto& c) { return c.tau; });
  const auto given = pack([](const auto& c) { return c.given; });
  const auto external = pack([](const auto& c) { return c.external; });
  SweepInput<Group> in;
  in.q = q.data();
  in.v = v.data();
  in.tau = tau.data();
  in.prescribed = given.data();
  in.external = external.data();
  ConstraintElimination<Group> lanes(model);
  ConstraintElimination<double> one(model);
  std::vector<Group> du(model.nv()), loads(6 * model.n_joints()), f(lanes.n_unknowns());
  ASSERT_TRUE(lanes.evaluate(in, du.data(), loads.data(), f.data()));
  for (int l = 0; l < native_lanes; ++l) {
    std::vector<double> want_du(du.size()), want_loads(loads.size()), want_f(f.size());
    one.evaluate(cases[l].input(), want_du.data(), want_loads.data(), want_f.data());
    const auto of_lane = [&](const std::vector<Group>& all) {
      std::vector<double> out;
      for (const Group& x : all) out.push_back(x[l]);
      return out;
    };
    expect_close(of_lane(du), want_du, 1e-10, "accelerations");
    expect_close(of_lane(loads), want_loads, 1e-10, "loads");
    expect_close(of_lane(f), want_f, 1e-9, "forces");
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, Eliminations, ::testing::ValuesIn(machines_to_eliminate()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace linkwise::testing
