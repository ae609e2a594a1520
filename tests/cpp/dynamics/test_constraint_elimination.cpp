#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/constraint_elimination.hpp"
#include "linkwise/dynamics/constraint_force.hpp"

namespace linkwise::testing {
namespace {

/// Joints of one axis in chains, trees and on one body, every second pair with a rotor; screws of
/// either hand, and one that does not advance.
std::vector<Machine> one_axis_machines() {
  using enum JointType;
  std::vector<Machine> all;
  Draws draws(81);
  const auto add = [&](const std::string& name, const std::vector<JointType>& kinds, int n,
                       const std::vector<int>& parents) {
    std::vector<JointType> types(n);
    for (int i = 0; i < n; ++i) types[i] = kinds[i % kinds.size()];
    ModelSpec spec = tree_spec(types, parents, draws);
    if (kinds[0] == helical) spec.joints.back().axes[0].pitch = 0;
    all.push_back({name, spec});
    for (int i = 0; i < n; ++i)
      if (i % 4 < 2) spec.joints[i].dof.push_back({DofProperty::armature, {0.1 + 0.2 * i}});
    all.push_back({name + "_geared", spec});
    spec.floating_base = true;
    all.push_back({name + "_floating", spec});
  };
  const std::vector<JointType> mixed{helical, prismatic, revolute, prismatic, helical};
  for (const auto& [name, kinds] : {std::pair{"slides", std::vector{prismatic}},
                                    {"screws", std::vector{helical}},
                                    {"mixed_axes", mixed}}) {
    add(std::string(name) + "_chain", kinds, 11, chain_parents(11));
    add(std::string(name) + "_tree", kinds, 14, random_parents(14, draws));
    add(std::string(name) + "_on_one_body", kinds, 7, {-1, 0, 0, 0, 0, 0, 0});
  }
  return all;
}

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

// The factors of one evaluation serve any other right-hand side at the same position.
TEST_P(Eliminations, AgainEqualAnew) {
  const Model model(GetParam().spec);
  ConstraintElimination<double> kept(model), anew(model);
  const DynamicsCase first(model, 56), other(model, 57);
  const std::vector<double> none(model.nv());
  std::vector<double> du(model.nv(), NAN), loads(6 * model.n_joints(), NAN),
      f(kept.n_unknowns(), NAN), want(du), want_loads(loads), want_f(f);
  ASSERT_TRUE(kept.evaluate(first.input(), du.data(), nullptr));
  for (const char* cause : {"all", "rest", "gravity", "velocity", "motion", "external"}) {
    const std::string only = cause;
    SweepInput<double> in = other.input();
    in.q = first.state.q.data();
    if (only != "all" && only != "velocity") in.v = nullptr;
    if (only != "all") in.tau = none.data();
    if (only != "all" && only != "motion") in.prescribed = nullptr;
    if (only != "all" && only != "external") in.external = nullptr;
    if (only != "all" && only != "gravity") in.gravity_factor = 0;
    ASSERT_TRUE(anew.evaluate(in, want.data(), want_loads.data(), want_f.data()));
    kept.evaluate_again(in, du.data(), loads.data(), f.data());
    expect_close(du, want, 1e-13, only + ", accelerations");
    expect_close(loads, want_loads, 1e-13, only + ", loads");
    expect_close(f, want_f, 1e-13, only + ", forces");
  }
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
