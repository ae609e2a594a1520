// Conjugate gradients preconditioned by exact solves on pieces of k joints, without and with a
// coarse space.
//
// The pieces alone are additive Schwarz without overlap, block Jacobi with larger blocks
// [smith1996, chapter 1]. Every piece can work at once. The iterations fall with k, but on a chain
// whose condition grows with its length they still grow with the number of pieces; the coarse space
// cures that.
//
// With J the pieces and Q = V (V^T A V)^-1 V^T the coarse correction, the preconditioner is
//     z = J^-1 r,   z <- z + Q (r - A z),
// the A-DEF2 form of [tang2009], which with a start that satisfies V^T r = 0 is as good as the
// symmetric one at half its cost: r - A z only has entries at the cuts. The coarse space holds what
// passes the cuts freely (CoarseSpace), so that the iterations depend on neither the number of
// pieces nor on what the chain's condition number grows with.

#include <algorithm>

#include "linkwise/linear/residual.hpp"
#include "linkwise/linear/vector.hpp"
#include "linkwise/solve/direct/tree_factor.hpp"
#include "linkwise/solve/iterative/coarse_space.hpp"
#include "linkwise/solve/iterative/preconditioned.hpp"

namespace linkwise {
namespace {

constexpr Option block_size{.name = "block_size",
                            .fallback = 0,
                            .text = "joints per piece; 0: default",
                            .accepts = at_least_zero,
                            .wanted = "give 1 or more, or 0 for the solver's default"};

/// cut[i] = 1 where node i starts a piece of its own: every `joints` nodes down from the base. The
/// joints of a hub stay together with its inboard joint, so that pieces around hubs grow larger and
/// a tree that branches everywhere stays whole.
void cut_into_pieces(const BlockTree& A, int joints, std::vector<char>& cut) {
  std::vector<int> depth(A.n(), 1);
  cut.assign(A.n(), 0);
  for (int i = 0; i < A.n(); ++i) {
    const int p = A.parent[i];
    if (p < 0) continue;
    depth[i] = depth[p] + 1;
    if (depth[i] <= joints || A.lever_of[i] >= 0) continue;
    depth[i] = 1;
    cut[i] = 1;
  }
}

class BlockSchwarz : public PreconditionedConjugateGradient {
 public:
  BlockSchwarz(const SolverOptions& options, int default_size)
      : PreconditionedConjugateGradient(options, Coordinates::original),
        joints_(options.own.count(block_size) > 0 ? options.own.count(block_size) : default_size) {}

 protected:
  Outcome prepare(const BlockTree& A) override {
    if (!pieces_.fits(A)) cut_into_pieces(A, joints_, cut_);
    const Outcome outcome = pieces_.factor(A, cut_);
    set_failed_node(pieces_.failed_node());
    return outcome;
  }

  void precondition(std::span<const double> r, std::span<double> z) override {
    std::copy(r.begin(), r.end(), z.begin());
    pieces_.solve_in_place(z);
  }

  int joints_;
  TreeFactor pieces_;
  std::vector<char> cut_;
};

class TwoLevel final : public BlockSchwarz {
 public:
  using BlockSchwarz::BlockSchwarz;

 private:
  // Cosines below this converge within the iteration: fewer coarse vectors, hardly more iterations.
  static constexpr double threshold = 0.4;

  Outcome prepare(const BlockTree& A) override {
    const bool known = pieces_.fits(A);
    const Outcome outcome = BlockSchwarz::prepare(A);
    if (outcome != Outcome::converged) return outcome;
    if (!known) coarse_.set_pieces(A, cut_);
    coarse_.build(A, pieces_, threshold);
    for (std::vector<double>* v : {&work_.r, &scratch_, &correction_}) v->resize(A.size());
    return outcome;
  }

  void precondition(std::span<const double> r, std::span<double> z) override {
    BlockSchwarz::precondition(r, z);
    coarse_.restrict_cuts(system(), z);
    coarse_.solve();
    coarse_.prolong_add(z);
  }

  // r = A Q r + (the rest): the coarse part's energy is exact, the pieces' that of the rest.
  double preconditioned_square(std::span<const double> residual) override {
    coarse_.restrict_all(residual);
    const double coarse_energy = coarse_.solve();
    std::fill(correction_.begin(), correction_.end(), 0.0);
    coarse_.prolong_add(correction_);
    multiply(correction_, scratch_);
    subtract_from(residual, scratch_, executor());
    std::copy(scratch_.begin(), scratch_.end(), correction_.begin());
    pieces_.solve_in_place(correction_);
    return coarse_energy + dot(scratch_, correction_, executor());
  }

  void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) override {
    project_start(b, x);
    run_conjugate_gradients(b, x, stop, true);
  }

  // x += Q (b - A x). The slowest modes live here; where they are so slow that one correction in
  // working precision does not get them right, further ones from an accurate residual do.
  void project_start(std::span<const double> b, std::span<double> x) {
    double first = 0.0;
    for (int pass = 0; pass < 6; ++pass) {
      if (pass < 2) {
        multiply(x, work_.r);
        subtract_from(b, work_.r, executor());
      } else {
        accurate_residual(system(), b, x, work_.r);
      }
      coarse_.restrict_all(work_.r);
      const double energy = coarse_.solve();
      if (pass == 0) first = energy;
      const double scale = std::max(first, dot(x, b, executor()));
      if (pass > 0 && energy <= 1e-3 * options_.tolerance * options_.tolerance * scale) return;
      coarse_.prolong_add(x);
    }
    accurate_residual(system(), b, x, work_.r);
  }

  CoarseSpace coarse_;
  std::vector<double> scratch_, correction_;
};

}  // namespace

std::span<const Option> pieces_options() { return {&block_size, 1}; }

std::unique_ptr<LinearSolver> make_block_schwarz_conjugate_gradient(const SolverOptions& options) {
  return std::make_unique<BlockSchwarz>(options, 8);
}

std::unique_ptr<LinearSolver> make_two_level(const SolverOptions& options) {
  return std::make_unique<TwoLevel>(options, 32);
}

}  // namespace linkwise
