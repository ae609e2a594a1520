// Twisted block elimination [babuska1972]: the recurrence of block Thomas
// from the tip inboard and the same from the base outboard, until they meet in the middle node. The
// two are independent of each other: two threads, or the two halves of one core's pipeline, run
// them at once.

#include <algorithm>
#include <vector>

#include "linkwise/linear/ldlt.hpp"
#include "linkwise/solve/direct/chain_order.hpp"
#include "linkwise/solve/direct/direct_solver.hpp"

namespace linkwise {
namespace {

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

/// Eliminates node i, whose pivot is complete, into its neighbour's pivot.
bool Twisted::eliminate(const BlockTree& A, int i, int into) {
  Node& node = nodes_[i];
  const int cols = into < 0 ? 0 : A.dim[into];
  return with_dims(A.dim[i], cols, [&](auto d, auto c) {
    const bool good = ldlt_factor<d.n>(node.lower.data());
    if (into < 0) return good;
    const bool inboard = A.parent[i] == into;
    const Block& block = inboard ? A.parent_block[i] : A.parent_block[into];
    for (int r = 0; r < d.n; ++r)
      for (int k = 0; k < c.n; ++k)
        node.coupling[6 * r + k] = inboard ? block[6 * r + k] : block[6 * k + r];
    ldlt_forward_block<d.n, c.n>(node.lower.data(), node.coupling.data());
    ldlt_downdate<d.n, c.n>(node.lower.data(), node.coupling.data(), nodes_[into].lower.data());
    return good;
  });
}

int Twisted::factor_matrix(const BlockTree& A) {
  order_.set(A, "twisted");
  nodes_.resize(A.n());
  for (int i = 0; i < A.n(); ++i)
    with_dim(A.dim[i], [&](auto d) { pack_lower<d.n>(A.diag[i].data(), nodes_[i].lower.data()); });
  for (int chain = 0; chain < order_.chains(); ++chain) {
    const int* const at = order_.nodes(chain);
    int base = 0, tip = order_.length(chain) - 1;
    for (; tip - base > 1; ++base, --tip) {
      if (!eliminate(A, at[tip], at[tip - 1])) return at[tip];
      if (!eliminate(A, at[base], at[base + 1])) return at[base];
    }
    if (tip > base && !eliminate(A, at[tip], at[base])) return at[tip];
    if (!eliminate(A, at[base], -1)) return at[base];
  }
  return -1;
}

void Twisted::forward(const BlockTree& A, int i, int into, double* x) const {
  with_dims(A.dim[i], into < 0 ? 0 : A.dim[into], [&](auto d, auto c) {
    double* const xi = x + A.offset[i];
    ldlt_forward<d.n>(nodes_[i].lower.data(), xi);
    ldlt_scale<d.n>(nodes_[i].lower.data(), xi);
    if (into >= 0)
      block_transpose_multiply_add<d.n, c.n>(nodes_[i].coupling.data(), xi, x + A.offset[into],
                                             -1.0);
  });
}

void Twisted::backward(const BlockTree& A, int i, int from, double* x) const {
  with_dims(A.dim[i], from < 0 ? 0 : A.dim[from], [&](auto d, auto c) {
    double* const xi = x + A.offset[i];
    if (from >= 0) {
      double inner[6] = {};
      block_multiply_add<d.n, c.n>(nodes_[i].coupling.data(), x + A.offset[from], inner, 1.0);
      ldlt_scale<d.n>(nodes_[i].lower.data(), inner);
      for (int k = 0; k < d.n; ++k) xi[k] -= inner[k];
    }
    ldlt_backward<d.n>(nodes_[i].lower.data(), xi);
  });
}

void Twisted::solve_in_place(const BlockTree& A, std::span<double> x) {
  for (int chain = 0; chain < order_.chains(); ++chain) {
    const int* const at = order_.nodes(chain);
    const int length = order_.length(chain);
    int base = 0, tip = length - 1;
    for (; tip - base > 1; ++base, --tip) {
      forward(A, at[tip], at[tip - 1], x.data());
      forward(A, at[base], at[base + 1], x.data());
    }
    if (tip > base) forward(A, at[tip], at[base], x.data());
    forward(A, at[base], -1, x.data());
    backward(A, at[base], -1, x.data());
    if (tip > base) backward(A, at[tip], at[base], x.data());
    for (--base, ++tip; base >= 0; --base, ++tip) {
      backward(A, at[base], at[base + 1], x.data());
      backward(A, at[tip], at[tip - 1], x.data());
    }
  }
}

}  // namespace

std::unique_ptr<LinearSolver> make_twisted(const SolverOptions& options) {
  return std::make_unique<Twisted>(options);
}

}  // namespace linkwise
