#pragma once
// Conjugate gradients on the system of a graph, preconditioned by the block diagonal D_A (J-CG of
// [sharf1993]). Where constraints repeat each other A is singular, and the solution found is that
// of least x^T D_A x beside the start.
#include <vector>

#include "linkwise/linear/block_graph.hpp"
#include "linkwise/solve/iterative/krylov.hpp"
#include "linkwise/solve/solver.hpp"

namespace linkwise {

class GraphConjugateGradient {
 public:
  explicit GraphConjugateGradient(const SolverOptions& options) : options_(options) {}

  /// x from zero. The report's error is an estimate.
  Report solve(const BlockGraph& A, std::span<const double> b, std::span<double> x);

 private:
  void iterate(const BlockGraph& A, std::span<const double> b, std::span<double> x);
  void verify(const BlockGraph& A, std::span<const double> b, std::span<double> x, Report& report);
  int factor_diagonal(const BlockGraph& A);
  void precondition(const BlockGraph& A, std::span<const double> r, std::span<double> z) const;

  SolverOptions options_;
  StopTest stop_;
  KrylovVectors work_;
  std::vector<double> diagonal_, motions_, left_, more_;
};

}  // namespace linkwise
