// Every method of the table on every machine, against the world-frame twin.
#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/composite_rigid_body.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise::testing {
namespace {

bool branches(const Model& model) {
  for (int n = 0; n < model.n_bodies(); ++n)
    if (model.topology[n].n_children > 1) return true;
  return false;
}

/// Every method; those with a solver once with each direct solver and with conjugate gradients, as
/// exact as they go.
std::vector<DynamicsOptions> all_options(const Model& model) {
  std::vector<DynamicsOptions> all;
  for (const DynamicsEntry& entry : dynamics_table()) {
    if (!takes(entry, model)) continue;
    DynamicsOptions options;
    options.method = entry.name;
    options.solver_options.tolerance = 1e-13;
    options.solver_options.max_iterations = 100000;
    if (!entry.uses_solver) all.push_back(options);
    if (!entry.uses_solver) continue;
    for (const SolverEntry& solver : solver_table()) {
      if (solver.kind != SolverKind::direct && solver.name != "conjugate_gradient") continue;
      if (solver.chains_only && branches(model)) continue;
      options.solver = solver.name;
      all.push_back(options);
    }
  }
  return all;
}

class Methods : public ::testing::TestWithParam<Machine> {};

TEST_P(Methods, EqualTheWorldTwin) {
  const Model model(GetParam().spec);
  const WorldTwin twin(model);
  const DynamicsCase c(model, 21);
  std::vector<double> du = c.given;
  twin.forward_dynamics(c.state.q, c.state.v, c.tau, c.external, du);
  const WorldTwin::Inverse want = twin.inverse_dynamics(c.state.q, c.state.v, du, c.external);
  for (const DynamicsOptions& options : all_options(model)) {
    const std::string name = options.method + " " + options.solver;
    const auto method = make_dynamics(model, options);
    const Motion6 got = evaluate(*method, model, c.input());
    expect_close(got.du, du, 1e-10, "accelerations of " + name);
    expect_close(got.loads, want.loads, 1e-10, "loads of " + name);
    // The second evaluation of one object starts from the leftovers of the first.
    const Motion6 again = evaluate(*method, model, c.input());
    expect_close(again.du, du, 1e-10, "accelerations again, of " + name);
  }
}

TEST_P(Methods, WhatIsAbsentIsZero) {
  const Model model(GetParam().spec);
  const DynamicsCase c(model, 22);
  const std::vector<double> zero(model.nv()), no_wrench(6 * model.n_joints());
  ModelSpec weightless = GetParam().spec;
  weightless.gravity = {};
  const Model without_gravity(weightless);
  SweepInput<double> absent, zeros = c.input();
  absent.q = zeros.q;
  absent.tau = zeros.tau;
  absent.gravity_factor = 0;
  zeros.v = zero.data();
  zeros.prescribed = zero.data();
  zeros.external = no_wrench.data();
  for (const DynamicsOptions& options : all_options(model)) {
    const Motion6 a = evaluate(*make_dynamics(model, options), model, absent);
    const Motion6 b = evaluate(*make_dynamics(without_gravity, options), without_gravity, zeros);
    expect_close(a.du, b.du, 1e-12, "accelerations of " + options.method);
    expect_close(a.loads, b.loads, 1e-12, "loads of " + options.method);
  }
}

TEST_P(Methods, InverseDynamicsEqualsTheWorldTwin) {
  const Model model(GetParam().spec);
  const WorldTwin twin(model);
  const DynamicsCase c(model, 23);
  const std::vector<double>& du = c.given;
  const WorldTwin::Inverse want = twin.inverse_dynamics(c.state.q, c.state.v, du, c.external);
  std::vector<double> tau(model.nv()), loads(6 * model.n_joints());
  InverseDynamics<double> inverse(model);
  inverse.evaluate(c.input(), du.data(), tau.data(), loads.data());
  add_armature_bias(model, c.input().v, 1, tau.data());
  expect_close(tau, want.tau, 1e-12, "tau");
  expect_close(loads, want.loads, 1e-12, "loads");
}

// The torques of unit accelerations add up along a chain, so those at its tip are known to fewer
// digits than in the test above.
TEST_P(Methods, ForwardUndoesInverse) {
  const Model model(GetParam().spec);
  const DynamicsCase c(model, 24);
  std::vector<double> tau(model.nv()), loads(6 * model.n_joints());
  InverseDynamics<double> inverse(model);
  inverse.evaluate(c.input(), c.given.data(), tau.data(), loads.data());
  SweepInput<double> in = c.input();
  add_armature_bias(model, in.v, 1, tau.data());
  in.tau = tau.data();
  for (const DynamicsOptions& options : all_options(model)) {
    const Motion6 got = evaluate(*make_dynamics(model, options), model, in);
    expect_close(got.du, c.given, 1e-9, "accelerations of " + options.method);
    expect_close(got.loads, loads, 1e-9, "loads of " + options.method);
  }
}

TEST_P(Methods, MassMatrixEqualsTheWorldTwin) {
  ModelSpec spec = GetParam().spec;
  spec.prescribed.clear();
  const Model model(spec);
  const DynamicsCase c(model, 25);
  const size_t nv = model.nv();
  std::vector<double> H(nv * nv);
  CompositeRigidBody(model).mass_matrix(c.state.q.data(), H.data());
  expect_close(H, WorldTwin(model).mass_matrix(c.state.q), 1e-12, "mass matrix");
}

INSTANTIATE_TEST_SUITE_P(Machines, Methods, ::testing::ValuesIn(all_machines()),
                         [](const auto& test) { return test.param.name; });

TEST(MassMatrix, PrescribedRowsAreThoseOfTheIdentity) {
  Draws draws(1);
  ModelSpec spec = tree_spec({JointType::revolute, JointType::universal, JointType::prismatic},
                             chain_parents(3), draws);
  const DynamicsCase c(Model(spec), 1);
  const std::vector<double> whole = WorldTwin(Model(spec)).mass_matrix(c.state.q);
  spec.prescribed = {"joint1"};
  const Model model(spec);
  std::vector<double> H(16);
  CompositeRigidBody(model).mass_matrix(c.state.q.data(), H.data());
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      const bool free = i % 3 == 0 && j % 3 == 0;
      EXPECT_NEAR(H[4 * i + j], free ? whole[4 * i + j] : i == j, 1e-12);
    }
}

// No recursion depth, and backward stable: the torques of the computed motion equal the given ones
// up to what a relative error of 1e-12 in the accelerations costs.
TEST(LongChain, TorquesOfTheMotionAreThoseGiven) {
  const int n = 50'000;
  Draws draws(3);
  const Model model(tree_spec(std::vector(n, JointType::revolute), chain_parents(n), draws));
  const DynamicsCase c(model, 2);
  const auto largest = [](const std::vector<double>& x) {
    return std::abs(*std::max_element(
        x.begin(), x.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }));
  };
  InverseDynamics<double> inverse(model);
  SweepInput<double> at_rest;
  at_rest.q = c.state.q.data();
  at_rest.gravity_factor = 0;
  for (const char* method : {"articulated_body", "constraint_force"}) {
    DynamicsOptions options;
    options.method = method;
    const Motion6 got = evaluate(*make_dynamics(model, options), model, c.input());
    std::vector<double> error = got.du, tau(n), cost(n);
    for (double& x : error) x *= 1e-12 * (draws.below(2) ? 1 : -1);
    inverse.evaluate(at_rest, error.data(), cost.data(), nullptr);
    inverse.evaluate(c.input(), got.du.data(), tau.data(), nullptr);
    for (int i = 0; i < n; ++i) tau[i] -= c.tau[i];
    EXPECT_LT(largest(tau), largest(cost)) << method;
  }
}

}  // namespace
}  // namespace linkwise::testing
