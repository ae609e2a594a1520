#pragma once
// Block Thomas: block L D L^T along the chain, leaf to root on a tree, hubs in O(outboard joints).

#include <vector>

#include "linkwise/solve/direct/tree_factor.hpp"
#include "linkwise/solve/solver.hpp"

namespace linkwise {

class Thomas final : public LinearSolver {
 public:
  explicit Thomas(const SolverOptions& options) : LinearSolver(options) {}

  Report solve(const BlockTree& A, std::span<const double> b, std::span<double> x) override;
  Report solve_many(const BlockTree& A, int count, std::span<const double> b,
                    std::span<double> x) override;

  /// The two halves of solve(), for right-hand sides that become known later.
  Report factor(const BlockTree& A);
  Report solve_factored(const BlockTree& A, std::span<const double> b, std::span<double> x);

 private:
  Report refine(const BlockTree& A, std::span<const double> b, std::span<double> x);

  TreeFactor factor_;
  std::vector<double> residual_, correction_;
};

std::unique_ptr<LinearSolver> make_thomas(const SolverOptions& options);

}  // namespace linkwise
