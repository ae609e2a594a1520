#pragma once
// Block cyclic reduction of chains: log2 N levels of independent eliminations.

#include <memory>
#include <vector>

#include "linkwise/linear/ldlt.hpp"
#include "linkwise/solve/direct/chain_order.hpp"
#include "linkwise/solve/direct/direct_solver.hpp"

namespace linkwise {

class CyclicReduction final : public DirectSolver {
 public:
  explicit CyclicReduction(const SolverOptions& options) : DirectSolver(options) {}

 private:
  struct Node {
    PackedLower lower;  ///< the pivot block, then its L and 1 / D
    Block coupling;     ///< to the nearest remaining node towards the base, padded with zeros
    Block base, tip;    ///< L^-1 times the couplings to both neighbours when it was eliminated
  };

  int factor_matrix(const BlockTree& A) override;
  void solve_in_place(const BlockTree& A, std::span<double> x) override;
  bool eliminate(const BlockTree& A, int base, int i, int tip);
  void forward(const BlockTree& A, int base, int i, int tip, double* x) const;
  void backward(const BlockTree& A, int base, int i, int tip, double* x) const;

  ChainOrder order_;
  std::vector<Node> nodes_;
};

std::unique_ptr<LinearSolver> make_cyclic_reduction(const SolverOptions& options);

}  // namespace linkwise
