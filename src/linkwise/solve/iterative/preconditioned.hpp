#pragma once
// Conjugate gradients with a preconditioner of the solver's own: what they share.

#include <vector>

#include "linkwise/solve/iterative/iterative_solver.hpp"
#include "linkwise/solve/iterative/krylov.hpp"

namespace linkwise {

class PreconditionedConjugateGradient : public IterativeSolver {
 protected:
  using IterativeSolver::IterativeSolver;

  /// z = M^-1 r in the coordinates of the iteration; r and z do not overlap.
  virtual void precondition(std::span<const double> r, std::span<double> z) = 0;

  double preconditioned_square(std::span<const double> residual) override {
    preconditioned_.resize(residual.size());
    precondition(residual, preconditioned_);
    return dot(residual, preconditioned_, executor());
  }

  void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) override {
    run_conjugate_gradients(b, x, stop, false);
  }

  /// residual_is_known: work_.r holds b - A x already.
  void run_conjugate_gradients(std::span<const double> b, std::span<double> x, StopTest& stop,
                               bool residual_is_known) {
    conjugate_gradients(
        b, x, stop, work_,
        [this](std::span<const double> v, std::span<double> w) { multiply(v, w); },
        [this](std::span<const double> r, std::span<double> z) -> std::span<const double> {
          precondition(r, z);
          return z;
        },
        executor(), 0.0, residual_is_known);
  }

  KrylovVectors work_;
  std::vector<double> preconditioned_;
};

}  // namespace linkwise
