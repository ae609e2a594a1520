#pragma once
// How accurately the constraint forces must be known for the integrator not to notice their error.
//
// Let e bound the forces' error in the A-norm and that of the joints' accelerations,
//     a^T H a <= e^2    (theory of constraint forces),
// hence |a_i| <= sqrt((H^-1)_ii) e. Over a step of length h it moves the rates by h a. The
// integrator accepts errors of 1 in the norm sqrt(mean_i (error_i / w_i)^2) over the n components
// of its state, w_i = rtol |y_i| + atol. The forces may take a tenth of it, as in [sharf1993] and
// in SUNDIALS' own iterations:
//     e <= 0.1 / (h sqrt(sum_i (H^-1)_ii / w_i^2 / n))
#include <memory>

#include "linkwise/dynamics/mobility.hpp"
#include "linkwise/solve/solver.hpp"

namespace linkwise {

class SolverTolerance {
 public:
  /// `relative`: the tolerance of the forces without an error test; a hundredth of it is the least.
  SolverTolerance(const Model& model, double step_relative, double step_absolute, double relative);

  /// What the solver reads.
  std::shared_ptr<const EnergyBound> bound() const { return bound_; }

  void start(double t);
  void accepted(double t, const double* q, const double* v);
  /// Before an evaluation at t.
  void set(double t);

 private:
  const Model* model_;
  Mobility mobility_;
  double step_relative_, step_absolute_, relative_;
  std::shared_ptr<EnergyBound> bound_;
  double time_ = 0, last_step_ = 0;
  double rate_error_ = 0;  ///< in units of the weights, that an energy norm of 1 makes per second
  int steps_ = 0;
};

}  // namespace linkwise
