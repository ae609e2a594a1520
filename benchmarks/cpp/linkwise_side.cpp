#include <algorithm>
#include <memory>
#include <stdexcept>
#include <thread>

#include "contestant.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/batch.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/model/model.hpp"
#include "linkwise/solve/registry.hpp"
#include "machine.hpp"

using namespace linkwise;

namespace {

/// O(N^3) time and O(N^2) memory: beyond this it only costs time to show that it loses.
constexpr int largest_for_mass_matrix = 300;
/// One conjugate-gradient iteration costs a quarter of a direct solve, and random chains take about
/// six iterations per body.
constexpr int largest_for_iterations = 30;
constexpr double iterative_tolerance = 1e-12;

struct Shared {
  explicit Shared(const std::filesystem::path& folder)
      : model(deserialize(read_bytes(folder / "linkwise.model"))),
        states(read_states(folder, "linkwise")),
        batch(model) {}
  Model model;
  States states;
  BatchEvaluator batch;
  std::vector<double> acceleration, loads;
};

SweepInput<double> input(const Shared& shared, int k) {
  SweepInput<double> in;
  in.q = shared.states.q_at(k);
  in.v = shared.states.v_at(k);
  in.tau = shared.states.tau_at(k);
  return in;
}

/// The method is made at its first call, so that memory is that of the methods that are used.
Contestant single(const std::shared_ptr<Shared>& shared, const std::string& name,
                  const DynamicsOptions& options, bool with_loads = true) {
  auto method = std::make_shared<std::unique_ptr<DynamicsMethod>>();
  return {name, 1, 1, with_loads, shared->model.nv(), [shared, method, options, with_loads](int k) {
            if (!*method) *method = make_dynamics(shared->model, options);
            double* loads = with_loads ? shared->loads.data() : nullptr;
            const DynamicsReport report =
                (*method)->evaluate(0, input(*shared, k), shared->acceleration.data(), loads);
            if (!report.ok()) throw std::runtime_error(std::string(message(report.outcome)));
            return shared->acceleration.data();
          }};
}

Contestant batch(const std::shared_ptr<Shared>& shared) {
  const int count = shared->states.count;
  return {"batch", count, 1, true, shared->model.nv(), [shared, count](int) {
            const size_t rows = count;
            shared->acceleration.resize(rows * shared->model.nv());
            shared->loads.resize(rows * 6 * shared->model.n_joints());
            BatchInput in;
            in.q = shared->states.q.data();
            in.v = shared->states.v.data();
            in.tau = shared->states.tau.data();
            if (shared->batch.forward_dynamics(count, in, shared->acceleration.data(),
                                               shared->loads.data()) >= 0)
              throw std::runtime_error("not positive definite");
            return shared->acceleration.data();
          }};
}

bool is_chain(const Model& model) {
  for (int n = 0; n < model.n_bodies(); ++n)
    if (model.topology[n].parent != n - 1) return false;
  return true;
}

bool worth_trying(const SolverEntry& solver, const Model& model) {
  if (solver.chains_only && !is_chain(model)) return false;
  if (solver.kind == SolverKind::direct) return true;
  return solver.name == "conjugate_gradient" && model.n_bodies() <= largest_for_iterations;
}

}  // namespace

Field make_linkwise(const std::filesystem::path& folder) {
  const auto shared = std::make_shared<Shared>(folder);
  const int n = shared->model.n_bodies();
  shared->acceleration.resize(shared->model.nv());
  shared->loads.resize(6 * static_cast<size_t>(shared->model.n_joints()));
  Field field;
  field.states = shared->states.count;
  const auto enter = [&](const std::string& name, const DynamicsOptions& options) {
    try {
      make_dynamics(shared->model, options);
    } catch (const InputError&) {
      return;  // a method for other machines than this one
    }
    field.contestants.push_back(single(shared, name, options));
    field.contestants.back().threads = options.executor.threads();
  };
  const DynamicsOptions plain;
  enter("auto", plain);
  field.contestants.push_back(single(shared, "auto, no loads", plain, false));
  for (const DynamicsEntry& method : dynamics_table()) {
    if (!method.linear_time && n > largest_for_mass_matrix) continue;
    DynamicsOptions options;
    options.method = method.name;
    options.solver_options.tolerance = iterative_tolerance;
    if (!method.uses_solver) {
      enter(std::string(method.name), options);
      continue;
    }
    for (const SolverEntry& solver : solver_table()) {
      if (!worth_trying(solver, shared->model)) continue;
      options.solver = solver.name;
      enter(std::string(method.name) + " + " + std::string(solver.name), options);
    }
  }
  field.contestants.push_back(batch(shared));
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  for (int threads = 1; threads <= cores; threads *= 2) {
    DynamicsOptions options;
    options.executor = Executor(threads);
    enter(std::to_string(threads) + (threads > 1 ? " threads" : " thread"), options);
  }
  return field;
}
