// Block Thomas algorithm: block L D L^T along the chain, leaf to root on a tree, hubs in O(outboard
// joints). See tree_factor.cpp.

#include "linkwise/solve/direct/direct_solver.hpp"
#include "linkwise/solve/direct/tree_factor.hpp"

namespace linkwise {
namespace {

class Thomas final : public DirectSolver {
 public:
  explicit Thomas(const SolverOptions& options) : DirectSolver(options) {}

 private:
  int factor_matrix(const BlockTree& A) override {
    factor_.factor(A);
    return factor_.failed_node();
  }
  void solve_in_place(const BlockTree&, std::span<double> x) override { factor_.solve_in_place(x); }

  TreeFactor factor_;
};

}  // namespace

std::unique_ptr<LinearSolver> make_thomas(const SolverOptions& options) {
  return std::make_unique<Thomas>(options);
}

}  // namespace linkwise
