// The coarse matrix E = V^T A V of CoarseSpace: dense blocks along the tree of pieces.

#include <vector>

#include "linkwise/solve/iterative/coarse_space.hpp"

namespace linkwise {

/// E_jj, whose columns are responses J^-1 E f: row a of it is the force f_a on what the others do
/// at its node; and E_jq over the cut towards the base.
void CoarseSpace::assemble(const BlockTree& A, Piece& piece) {
  const std::size_t m = piece.columns.size();
  piece.pivot.assign(m * m, 0.0);
  for (std::size_t a = 0; a < m; ++a) {
    const Column& column = columns_[piece.columns[a]];
    for (std::size_t b = 0; b < m; ++b) {
      const double* const at = value(piece.columns[b], column.node);
      for (int k = 0; k < A.dim[column.node]; ++k)
        piece.pivot[m * a + b] += column.force[k] * at[k];
    }
  }
  if (piece.parent < 0) return;
  const Cut& cut = cuts_[piece.cut];
  const std::vector<int>& others = pieces_[piece.parent].columns;
  piece.inboard.assign(m * others.size(), 0.0);
  for (std::size_t a = 0; a < m; ++a) {
    double force[6] = {};  // on the tail by this column
    block_transpose_multiply_add(A.dim[cut.root], A.dim[cut.tail], A.parent_block[cut.root],
                                 value(piece.columns[a], cut.root), force);
    for (std::size_t b = 0; b < others.size(); ++b) {
      const double* const at = value(others[b], cut.tail);
      for (int k = 0; k < A.dim[cut.tail]; ++k)
        piece.inboard[others.size() * a + b] += force[k] * at[k];
    }
  }
}

/// Block L D L^T of the coarse matrix along the tree of pieces. The columns have unit energy, so a
/// pivot at rounding level belongs to a column that the others span already: it is left out.
void CoarseSpace::factor(const BlockTree& A) {
  constexpr double dependent = 1e-13;
  for (Piece& piece : pieces_) assemble(A, piece);
  for (auto it = pieces_.rbegin(); it != pieces_.rend(); ++it) {
    Piece& piece = *it;
    const std::size_t m = piece.columns.size();
    double* const l = piece.pivot.data();
    for (std::size_t j = 0; j < m; ++j) {
      const double inverse = l[m * j + j] > dependent ? 1.0 / l[m * j + j] : 0.0;
      for (std::size_t i = j + 1; i < m; ++i)
        for (std::size_t k = j + 1; k <= i; ++k)
          l[m * i + k] -= l[m * i + j] * l[m * k + j] * inverse;
      for (std::size_t i = j + 1; i < m; ++i) l[m * i + j] *= inverse;
      l[m * j + j] = inverse;
    }
    if (piece.parent < 0) continue;
    Piece& into = pieces_[piece.parent];
    const std::size_t cols = into.columns.size();
    double* const e = piece.inboard.data();
    for (std::size_t i = 1; i < m; ++i)
      for (std::size_t j = 0; j < i; ++j)
        for (std::size_t k = 0; k < cols; ++k) e[cols * i + k] -= l[m * i + j] * e[cols * j + k];
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t r = 0; r < cols; ++r)
        for (std::size_t k = 0; k < cols; ++k)
          into.pivot[cols * r + k] -= e[cols * i + r] * l[m * i + i] * e[cols * i + k];
  }
}

double CoarseSpace::solve() {
  double energy = 0.0;
  for (auto it = pieces_.rbegin(); it != pieces_.rend(); ++it) {
    const std::vector<int>& own = it->columns;
    const std::size_t m = own.size();
    for (std::size_t i = 1; i < m; ++i)
      for (std::size_t j = 0; j < i; ++j) coarse_[own[i]] -= it->pivot[m * i + j] * coarse_[own[j]];
    for (std::size_t i = 0; i < m; ++i) {
      const double scaled = coarse_[own[i]] * it->pivot[m * i + i];
      energy += coarse_[own[i]] * scaled;
      coarse_[own[i]] = scaled;
    }
    if (it->parent < 0) continue;
    const std::vector<int>& others = pieces_[it->parent].columns;
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t k = 0; k < others.size(); ++k)
        coarse_[others[k]] -= it->inboard[others.size() * i + k] * coarse_[own[i]];
  }
  for (Piece& piece : pieces_) {
    const std::vector<int>& own = piece.columns;
    const std::size_t m = own.size();
    if (piece.parent >= 0) {
      const std::vector<int>& others = pieces_[piece.parent].columns;
      for (std::size_t i = 0; i < m; ++i) {
        double sum = 0.0;
        for (std::size_t k = 0; k < others.size(); ++k)
          sum += piece.inboard[others.size() * i + k] * coarse_[others[k]];
        coarse_[own[i]] -= piece.pivot[m * i + i] * sum;
      }
    }
    for (std::size_t i = m; i-- > 1;)
      for (std::size_t j = 0; j < i; ++j)
        coarse_[own[j]] -= piece.pivot[m * i + j] * coarse_[own[i]];
  }
  return energy;
}

}  // namespace linkwise
