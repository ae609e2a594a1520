// Block Thomas algorithm: A x = b by elimination leaf to root and back. See tree_factor.cpp.

#include "linkwise/solve/direct/thomas.hpp"

namespace linkwise {

int Thomas::factor_matrix(const BlockTree& A) {
  factor_.factor(A);
  return factor_.failed_node();
}

void Thomas::solve_in_place(const BlockTree&, std::span<double> x) { factor_.solve_in_place(x); }

std::unique_ptr<LinearSolver> make_thomas(const SolverOptions& options) {
  return std::make_unique<Thomas>(options);
}

}  // namespace linkwise
