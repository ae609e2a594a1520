#pragma once
// What the direct solvers share: factor once and solve for one or several right-hand sides, with
// iterative refinement and the error estimate that comes with it.

#include <span>
#include <vector>

#include "linkwise/solve/solver.hpp"

namespace linkwise {

class DirectSolver : public LinearSolver {
 public:
  Report solve(const BlockTree& A, std::span<const double> b, std::span<double> x) final;
  Report solve_many(const BlockTree& A, int count, std::span<const double> b,
                    std::span<double> x) final;

 protected:
  explicit DirectSolver(const SolverOptions& options);

  /// Factors A; the node at which that fails, or -1.
  virtual int factor_matrix(const BlockTree& A) = 0;
  /// x <- A^-1 x by the factor.
  virtual void solve_in_place(const BlockTree& A, std::span<double> x) = 0;

 private:
  Report factor(const BlockTree& A);
  Report solve_factored(const BlockTree& A, std::span<const double> b, std::span<double> x);
  Report refine(const BlockTree& A, std::span<const double> b, std::span<double> x);

  int refinement_steps_;
  bool estimate_error_;
  std::vector<double> residual_, correction_;
};

/// Do the options ask for more than a factorisation and a solve?
bool ask_for_refinement(const SolverOptions& options);

}  // namespace linkwise
