// Conjugate gradients preconditioned by exact solves on pieces of k joints: additive Schwarz
// without overlap, block Jacobi with larger blocks [smith1996, chapter 1]. Every piece can work at
// once. The iterations fall with k, but on a chain whose condition grows with its length they still
// grow with the number of pieces; two_level cures that.

#include "linkwise/solve/iterative/block_schwarz_conjugate_gradient.hpp"

#include <algorithm>

#include "linkwise/solve/direct/tree_factor.hpp"
#include "linkwise/solve/iterative/pieces.hpp"
#include "linkwise/solve/iterative/preconditioned.hpp"

namespace linkwise {
namespace {

class BlockSchwarzConjugateGradient final : public PreconditionedConjugateGradient {
 public:
  explicit BlockSchwarzConjugateGradient(const SolverOptions& options)
      : PreconditionedConjugateGradient(options, Coordinates::original) {}

 private:
  static constexpr int default_block_size = 8;

  Outcome prepare(const BlockTree& A) override {
    if (!pieces_.fits(A))
      cut_into_pieces(A, options_.block_size > 0 ? options_.block_size : default_block_size, cut_);
    const Outcome outcome = pieces_.factor(A, cut_);
    set_failed_node(pieces_.failed_node());
    return outcome;
  }

  void precondition(std::span<const double> r, std::span<double> z) override {
    std::copy(r.begin(), r.end(), z.begin());
    pieces_.solve_in_place(z);
  }

  TreeFactor pieces_;
  std::vector<char> cut_;
};

}  // namespace

std::unique_ptr<LinearSolver> make_block_schwarz_conjugate_gradient(const SolverOptions& options) {
  return std::make_unique<BlockSchwarzConjugateGradient>(options);
}

}  // namespace linkwise
