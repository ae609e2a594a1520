#pragma once
// Twisted elimination of chains, from both ends to the middle.

#include <memory>
#include <vector>

#include "linkwise/linear/ldlt.hpp"
#include "linkwise/solve/direct/chain_order.hpp"
#include "linkwise/solve/direct/direct_solver.hpp"

namespace linkwise {

class Twisted final : public DirectSolver {
 public:
  explicit Twisted(const SolverOptions& options) : DirectSolver(options) {}

 private:
  struct Node {
    PackedLower lower;  ///< L and 1 / D of the pivot block
    Block coupling;     ///< L^-1 A_ij, j the neighbour towards the middle
  };

  int factor_matrix(const BlockTree& A) override;
  void solve_in_place(const BlockTree& A, std::span<double> x) override;
  bool eliminate(const BlockTree& A, int i, int into);
  void forward(const BlockTree& A, int i, int into, double* x) const;
  void backward(const BlockTree& A, int i, int from, double* x) const;

  ChainOrder order_;
  std::vector<Node> nodes_;
};

std::unique_ptr<LinearSolver> make_twisted(const SolverOptions& options);

}  // namespace linkwise
