#pragma once
// The stop tests of the iterative solvers, one object per solve.

#include <span>

#include "linkwise/linear/scaled_tree.hpp"
#include "linkwise/solve/energy_estimate.hpp"
#include "linkwise/solve/solver.hpp"

namespace linkwise {

/// What an iteration tells the stop test, in the coordinates it works in.
struct IterationStep {
  double decrease = 0.0;         ///< ||e||_A^2 before minus after this iteration
  double solution_energy = 0.0;  ///< estimate of ||x*||_A^2
  /// Upper bound of ||e||_A^2 where the method has one, else 0. Conjugate gradients have it from
  /// the smallest Ritz value; it holds once that has converged.
  double squared_bound = 0.0;
  /// The method's own estimate of ||e||_A^2, or a negative number for the stop test's.
  double squared_error = -1.0;
  std::span<const double> x;
  std::span<const double> change;  ///< x+ - x, up to `factor`
  double factor = 1.0;
  std::span<const double> residual;  ///< b - A x+; may be empty unless needs_residual()
};

class StopTest {
 public:
  /// `scaling`: the coordinates of the iteration, null for the original ones.
  void start(const SolverOptions& options, const ScaledTree* scaling, int max_iterations);
  /// As start(), for the correction of a solution of which ||x*||_A^2 is known already: the bound
  /// on the error stays that of the solution.
  void start_correction(double solution_energy, int max_iterations);

  bool needs_residual() const { return rule_ == StopRule::residual; }
  /// Norm of the right-hand side, for the residual rule.
  void set_right_hand_side(std::span<const double> b);

  /// Is a guess with a residual of this square, in the norm of the preconditioner's inverse, good
  /// enough as it is?
  bool accepts_start(double preconditioned_square);
  /// Counts an iteration. True if the solver has to stop; outcome() tells why.
  bool stops(const IterationStep& step);
  /// The solver stops on its own account; `converged` when there is nothing left to improve.
  void stop(Outcome outcome) {
    outcome_ = outcome;
    if (outcome == Outcome::converged) squared_error_ = 0.0;
  }

  /// ||x*||_A^2 as far as it is known before the first iteration.
  void set_solution_energy(double energy) {
    if (!correcting_) solution_energy_ = energy;
  }
  /// Lower bound of the spectrum of the preconditioned A as far as the iteration saw it.
  void set_smallest_eigenvalue(double value) {
    smallest_eigenvalue_ =
        correcting_ && value > smallest_eigenvalue_ ? smallest_eigenvalue_ : value;
  }
  double smallest_eigenvalue() const { return smallest_eigenvalue_; }

  Outcome outcome() const { return outcome_; }
  int iterations() const { return iterations_; }
  int iterations_left() const { return max_iterations_ - iterations_; }
  /// Bound that the energy rule puts on ||e||_A.
  double energy_bound() const;
  double solution_energy() const { return solution_energy_; }
  /// Estimate of ||e||_A / ||x*||_A.
  double relative_error() const;
  /// Estimate of ||e||_A^2 when the iteration stopped.
  double squared_error() const { return squared_error_; }
  const EnergyEstimate& estimate() const { return estimate_; }

 private:
  double calc_squared_error(const IterationStep& step) const;
  bool meets_energy_rule(const IterationStep& step) const;
  bool meets_rule(const IterationStep& step) const;
  bool at_rounding_level(const IterationStep& step) const;

  EnergyEstimate estimate_;
  const ScaledTree* scaling_ = nullptr;
  Executor executor_;
  StopRule rule_ = StopRule::energy_norm;
  double squared_error_ = 0.0, first_decrease_ = 0.0;
  double tolerance_ = 0.0, absolute_tolerance_ = 0.0;
  double right_hand_side_norm_ = 0.0;
  double solution_energy_ = 0.0;
  double smallest_eigenvalue_ = 1.0;
  int max_iterations_ = 0, iterations_ = 0;
  bool correcting_ = false;
  Outcome outcome_ = Outcome::converged;
};

}  // namespace linkwise
