#pragma once
// Everything that is computed of given states: accelerations and joint loads, torques of a motion,
// loads by cause. One place decides what computes them, by what was asked for and how many states
// there are:
//     one state     the method of the table that was asked for, or that "auto" stands for; the
//                   method itself splits large machines into pieces, paths or branches
//     many states   articulated_body, or constraint_force with thomas, on SIMD lanes; machines with
//                   loops one state in each thread; every other method state by state
#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "linkwise/dynamics/applied_states.hpp"
#include "linkwise/dynamics/batch.hpp"
#include "linkwise/dynamics/driven_inverse.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/dynamics/parts.hpp"

namespace linkwise {

/// Options of an evaluation that stands alone: no integrator says how accurate it must be.
DynamicsOptions evaluation_options();

/// How an evaluation went: the worst of its states, and what computed them.
struct EvaluationReport : DynamicsReport {
  Choice choice;          ///< the reason only where constraint forces are asked for
  std::string body_name;  ///< of the body at which it failed, or empty
};
EvaluationReport evaluation_report(const Model& model, Choice choice, const DynamicsReport& report);

/// Throws InputError where the machine does not determine its accelerations; see find_undetermined.
void require_determined(const Model& model);

/// What to do about a failure at a body (-1: at none): the outcome's remedy, or that of axes which
/// line up without mass between them.
std::string remedy_at(const Model& model, Outcome outcome, int body);

/// One line: the method, what happened, where, and the remedy.
std::string failure_text(const Model& model, const EvaluationReport& report);

/// Where forward dynamics goes. Loads and forces that are null are not computed.
struct ForwardOutput {
  double* acceleration = nullptr;                   ///< [count][nv]
  double* joint_load = nullptr;                     ///< [count][n_loads][6]
  std::vector<double>* constraint_force = nullptr;  ///< [count][unknowns]; empty without any
};

/// Where inverse dynamics goes; what is null is not computed.
struct InverseOutput {
  double* tau = nullptr;       ///< [count][nv]
  double* loop_tau = nullptr;  ///< [count][nv of loop joints]; only of driven ones
  double* loads = nullptr;     ///< [count][n_loads][6]
};

/// InputError, listing the known names, when one is unknown.
std::vector<Cause> causes_from_names(std::span<const std::string> names);

/// Evaluations of one model, which must outlive it. Calls from several threads at once each borrow
/// a workspace, and repeated calls allocate none. All throw InputError if the states do not fit the
/// model: a wrench on a link without mass, accelerations of joints that are free.
class Evaluator {
 public:
  explicit Evaluator(const Model& model);
  ~Evaluator();
  Evaluator(const Evaluator&) = delete;
  Evaluator& operator=(const Evaluator&) = delete;

  /// Threads are those of the options.
  EvaluationReport forward_dynamics(size_t count, const BatchInput& in,
                                    const DynamicsOptions& options, const ForwardOutput& out,
                                    const GoOn& go_on) const;

  /// loads [count][causes][n_loads][6]; the method is articulated_body or constraint_force.
  EvaluationReport loads_by_cause(size_t count, const BatchInput& in, std::span<const Cause> causes,
                                  const std::string& method, const Executor& executor,
                                  double* loads, const GoOn& go_on) const;

  /// Torques of the accelerations states.du, and loads. With passive_acts torques are what the
  /// drives give beside the passive forces. driven: joints that may have torques, none: all those
  /// of a tree. Machines with loops need some (driven_inverse.hpp), one state after the other; of
  /// trees nothing fails but input.
  EvaluationReport inverse_dynamics(size_t count, const BatchInput& in,
                                    std::span<const std::string> driven, const Executor& executor,
                                    const InverseOutput& out, const GoOn& go_on) const;

  /// H [count][nv][nv] of the tree and of all rotors; loops and couplings constrain the rates and
  /// leave it as it is.
  void mass_matrix(size_t count, const double* q, const Executor& executor, double* H,
                   const GoOn& go_on) const;

  /// M [count][n][n] in the coordinates of the n driven degrees of freedom, and the rates
  /// N [count][nv][n] that these make; either may be null.
  EvaluationReport reduce(size_t count, const double* q, DrivenInverse& driven, double* M,
                          double* N, const GoOn& go_on) const;

 private:
  struct Workspace;
  class Lease;
  struct Pick;
  Pick pick(Workspace& workspace, size_t count, const DynamicsOptions& options, bool forces,
            Choice& choice) const;
  void driven_inverse(size_t count, const BatchInput& states, std::span<const std::string> driven,
                      const InverseOutput& out, DynamicsReport& report, const GoOn& go_on) const;
  DynamicsReport over_threads(size_t count, const BatchInput& states,
                              const DynamicsOptions& options, const ForwardOutput& out,
                              const GoOn& go_on) const;

  const Model* model_;
  /// Workspaces that nobody uses. There is no lock: another thread's fork would keep it for ever.
  mutable std::array<std::atomic<Workspace*>, 64> idle_{};
};

}  // namespace linkwise
