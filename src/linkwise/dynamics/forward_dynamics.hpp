#pragma once
// The table of dynamics methods: ways from (q, v, tau) to accelerations and joint loads. A new
// method is one file and one line. Command line, Python, tests and benchmarks read the table.
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "linkwise/dynamics/batch.hpp"
#include "linkwise/dynamics/loop_report.hpp"
#include "linkwise/kinematics/body_state.hpp"
#include "linkwise/solve/initial_guess.hpp"
#include "linkwise/solve/solver.hpp"

namespace linkwise {

struct DynamicsOptions {
  std::string method = "auto";
  std::string solver = "auto";  ///< for method constraint_force
  std::string initial_guess = "zero";
  Executor executor;  ///< who shares the work; it influences no result
  SolverOptions solver_options;

  bool operator==(const DynamicsOptions&) const = default;
};

/// What an evaluation reports: the solver's report, and where it failed.
struct DynamicsReport : Report {
  int body = -1;  ///< at which it failed
  LoopReport loops = {};
};

class DynamicsMethod {
 public:
  virtual ~DynamicsMethod() = default;
  /// du [nv]; loads [n_loads][6] or null. t is only used to warm-start iterations.
  virtual DynamicsReport evaluate(double t, const SweepInput<double>& in, double* du,
                                  double* loads) = 0;
  /// Does it find the loop joints' states on its way, and tell in.on_loops?
  virtual bool finds_loops() const { return false; }
  /// The state at t was accepted by the integrator: warm starts may build on its solution.
  virtual void accepted(double /*t*/) {}
  /// Unknowns of the last evaluation; empty for methods without constraint forces.
  virtual std::span<const double> constraint_force() const { return {}; }
  /// Of the last evaluation: what couplings put into their joints, see ArticulatedLoops.
  virtual std::span<const double> coupling_load() const { return {}; }
};

struct DynamicsEntry {
  std::string_view name;
  std::string_view description;
  std::string_view reference;  ///< key in references.bib
  bool uses_solver = false;
  bool chains_only = false;  ///< takes one kind of machine; the others take every tree
  bool any_body = false;     ///< takes bodies of every kind; the others take rigid ones
  /// Of these kinds, those with coordinates of their own, too.
  bool own_coordinates = false;
  bool linear_time = false;  ///< work grows as the number of bodies; others: for short chains
  bool takes_loops = false;  ///< takes machines whose joints close loops; the others take trees
  /// What computes many states of a tree side by side, where no solver but thomas is asked for.
  std::optional<BatchMethod> on_lanes = {};
  std::unique_ptr<DynamicsMethod> (*make)(const Model&, const DynamicsOptions&);
};

std::span<const DynamicsEntry> dynamics_table();
/// InputError, listing the known names, when the name is unknown.
const DynamicsEntry& find_dynamics(std::string_view name);

/// InputError naming the first body of a kind that a method does not take.
void require_known_bodies(const Model& model, const DynamicsEntry& method);

/// What "auto" stands for on this model, and why.
struct Choice {
  std::string method, solver, reason;
};
Choice choose_dynamics(const Model& model, const DynamicsOptions& options);

/// Resolves "auto" and makes the method.
std::unique_ptr<DynamicsMethod> make_dynamics(const Model& model, const DynamicsOptions& options);

}  // namespace linkwise
