// Conjugate gradients preconditioned by exact solves on pieces of k joints: additive Schwarz
// without overlap, block Jacobi with larger blocks [smith1996, chapter 1]. Every piece can work at
// once. The iterations fall with k, but on a chain whose condition grows with its length they still
// grow with the number of pieces; two_level cures that.

#include "linkwise/solve/iterative/block_schwarz_conjugate_gradient.hpp"

#include <algorithm>

#include "linkwise/solve/direct/tree_factor.hpp"
#include "linkwise/solve/iterative/iterative_solver.hpp"
#include "linkwise/solve/iterative/krylov.hpp"
#include "linkwise/solve/iterative/pieces.hpp"

namespace linkwise {
namespace {

class BlockSchwarzConjugateGradient final : public IterativeSolver {
 public:
  explicit BlockSchwarzConjugateGradient(const SolverOptions& options)
      : IterativeSolver(options, Coordinates::original) {}

 private:
  static constexpr int default_block_size = 8;

  Outcome prepare(const BlockTree& A) override {
    if (!pieces_.fits(A))
      cut_into_pieces(A, options_.block_size > 0 ? options_.block_size : default_block_size, cut_);
    preconditioned_.resize(A.size());
    const Outcome outcome = pieces_.factor(A, cut_);
    set_failed_node(pieces_.failed_node());
    return outcome;
  }

  std::span<const double> precondition(std::span<const double> r, std::span<double> z) {
    std::copy(r.begin(), r.end(), z.begin());
    pieces_.solve_in_place(z);
    return z;
  }

  double preconditioned_square(std::span<const double> residual) override {
    return dot(residual, precondition(residual, preconditioned_));
  }

  void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) override {
    conjugate_gradients(
        b, x, stop, work_,
        [this](std::span<const double> v, std::span<double> w) { multiply(v, w); },
        [this](std::span<const double> r, std::span<double> z) { return precondition(r, z); });
  }

  TreeFactor pieces_;
  std::vector<char> cut_;
  KrylovVectors work_;
  std::vector<double> preconditioned_;
};

}  // namespace

std::unique_ptr<LinearSolver> make_block_schwarz_conjugate_gradient(const SolverOptions& options) {
  return std::make_unique<BlockSchwarzConjugateGradient>(options);
}

}  // namespace linkwise
