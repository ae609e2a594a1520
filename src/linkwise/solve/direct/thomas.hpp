#pragma once
// Block Thomas: block L D L^T along the chain, leaf to root on a tree, hubs in O(outboard joints).

#include <memory>

#include "linkwise/solve/direct/direct_solver.hpp"
#include "linkwise/solve/direct/tree_factor.hpp"

namespace linkwise {

class Thomas final : public DirectSolver {
 public:
  explicit Thomas(const SolverOptions& options) : DirectSolver(options) {}

 private:
  int factor_matrix(const BlockTree& A) override;
  void solve_in_place(const BlockTree& A, std::span<double> x) override;

  TreeFactor factor_;
};

std::unique_ptr<LinearSolver> make_thomas(const SolverOptions& options);

}  // namespace linkwise
