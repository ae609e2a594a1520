// Made and thrown away a thousand times: leaks and dangling pointers show under the sanitizers.
#include <gtest/gtest.h>

#include "linkwise/dynamics/batch.hpp"
#include "linkwise/simulate/batch_simulation.hpp"
#include "linkwise/solve/registry.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

constexpr int cycles = 1000;

TEST(Lifecycle, Models) {
  Draws draws(121);
  const ModelSpec spec = stacked_spec(draws);
  for (int i = 0; i < cycles; ++i) {
    const Model model(deserialize(serialize(spec)));
    const Model copy = model;
    ASSERT_EQ(copy.nv(), model.nv());
  }
}

TEST(Lifecycle, Methods) {
  Draws draws(122);
  const Model model(tree_spec(std::vector(16, JointType::revolute), chain_parents(16), draws));
  const MachineState state = random_state(model, draws);
  std::vector<double> tau(model.nv()), du(model.nv()), loads(6 * model.n_joints());
  SweepInput<double> in;
  in.q = state.q.data();
  in.v = state.v.data();
  in.tau = tau.data();
  for (int i = 0; i < cycles; ++i) {
    for (const DynamicsEntry& entry : dynamics_table()) {
      DynamicsOptions options;
      options.method = entry.name;
      ASSERT_TRUE(make_dynamics(model, options)->evaluate(0, in, du.data(), loads.data()).ok());
    }
    const BatchInput batch{.q = in.q, .v = in.v, .tau = in.tau};
    ASSERT_EQ(BatchEvaluator(model).forward_dynamics(1, batch, du.data(), nullptr), -1);
  }
}

TEST(Lifecycle, SolversByWayOfTheirTable) {
  Draws draws(123);
  const Model model(tree_spec(std::vector(3, JointType::universal), chain_parents(3), draws));
  for (int i = 0; i < cycles; ++i)
    for (const SolverEntry& entry : solver_table()) {
      DynamicsOptions options;
      options.solver = entry.name;
      ASSERT_NE(make_dynamics(model, options), nullptr);
    }
}

TEST(Lifecycle, Simulations) {
  Draws draws(124);
  const auto model = make_model(stacked_spec(draws));
  const MachineState state = random_state(*model, draws);
  const std::vector<double> at_rest(model->nv());
  Drive lock;
  lock.kind = DriveKind::locked;
  for (int i = 0; i < cycles; ++i)
    for (const IntegratorEntry& entry : integrator_registry()) {
      Simulation simulation(model, fixed_step(1e-3, entry.name));
      if (i % 2) simulation.set_drive(0, lock);
      simulation.start(0, {state.q.data(), at_rest.data()});
      ASSERT_EQ(run(simulation, {0.0015}).size(), 1u);
    }
}

TEST(Lifecycle, BatchesOfSimulations) {
  Draws draws(125);
  const auto model = make_model(stacked_spec(draws));
  const MachineState state = random_state(*model, draws);
  std::vector<double> q, v;
  for (int i = 0; i < 3; ++i) {
    q.insert(q.end(), state.q.begin(), state.q.end());
    v.insert(v.end(), state.v.begin(), state.v.end());
  }
  const double times[] = {0.0015};
  std::vector<double> loads(3 * 6 * model->n_joints());
  Sample sample;
  sample["joint_load"] = loads.data();
  for (int i = 0; i < cycles; ++i) {
    const Simulation simulation(model, with(fixed_step(1e-3), {"articulated_body"}));
    const Simulation* const all[] = {&simulation};
    const auto ends = simulate_batch(all, {q.data(), v.data(), nullptr, 3}, times, sample,
                                     Executor(2), [] { return true; });
    ASSERT_EQ(ends[2].outcome, Outcome::converged);
  }
}

}  // namespace
}  // namespace linkwise::testing
