#pragma once
// A method of forward dynamics with its memory: iterative solvers start from the solutions of
// earlier times, as in a simulation. An Evaluator remembers nothing.
#include <memory>
#include <span>
#include <vector>

#include "linkwise/dynamics/evaluator.hpp"

namespace linkwise {

class MethodOverTime {
 public:
  /// The options with the initial guess of a simulation.
  static DynamicsOptions usual_options();

  /// The model must outlive it. InputError as choose_dynamics() and make_dynamics().
  MethodOverTime(const Model& model, DynamicsOptions options);

  const Choice& choice() const { return choice_; }
  /// Of the last evaluation; empty for methods without constraint forces.
  std::span<const double> constraint_force() const { return method_->constraint_force(); }
  /// Forgets earlier times.
  void reset() { method_ = make_dynamics(*model_, options_); }

  /// du [nv] and loads [n_loads][6] of one state. accept: later guesses may build on it.
  EvaluationReport evaluate(double t, const BatchInput& state, double* du, double* loads,
                            bool accept);

  struct Step : DynamicsReport {
    double seconds = 0;  ///< that it took
  };
  /// du [times][nv] of one state per time, one after the other, all accepted. Ends early after
  /// time_limit seconds, or once go_on() is false.
  std::vector<Step> follow(std::span<const double> times, const BatchInput& states, double* du,
                           double time_limit, const GoOn& go_on);

 private:
  DynamicsReport evaluate(double t, const SweepInput<double>& in, double* du, double* loads);

  const Model* model_;
  Choice choice_;
  DynamicsOptions options_;
  std::unique_ptr<DynamicsMethod> method_;
};

}  // namespace linkwise
