#pragma once
// Conjugate gradients on the system of a graph, preconditioned by the block diagonal D_A (J-CG of
// [sharf1993]), in which rigid knots among elastic bodies are whole: P of knot_jacobi.hpp. Where
// constraints repeat each other A is singular, and the solution found is that of least x^T P x.
#include <vector>

#include "linkwise/linear/block_graph.hpp"
#include "linkwise/solve/iterative/knot_jacobi.hpp"
#include "linkwise/solve/iterative/krylov.hpp"
#include "linkwise/solve/solver.hpp"

namespace linkwise {

class GraphConjugateGradient {
 public:
  explicit GraphConjugateGradient(const SolverOptions& options) : options_(options) {}

  /// x from zero. The report's error is an estimate.
  Report solve(const BlockGraph& A, std::span<const double> b, std::span<double> x);
  const KnotJacobi& preconditioner() const { return P_; }

 private:
  void iterate(const BlockGraph& A, std::span<const double> b, std::span<double> x);
  void verify(const BlockGraph& A, std::span<const double> b, std::span<double> x, Report& report);

  SolverOptions options_;
  StopTest stop_;
  KrylovVectors work_;
  KnotJacobi P_;
  std::vector<double> motions_, left_, more_;
};

}  // namespace linkwise
