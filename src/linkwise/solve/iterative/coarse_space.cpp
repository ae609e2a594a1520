#include "linkwise/solve/iterative/coarse_space.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linkwise/base/symmetric_eigen.hpp"

namespace linkwise {
namespace {

/// Of the symmetric part; false when it is not positive definite.
bool regular_root(int n, Block& G, Block& R) {
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) G[6 * i + j] = 0.5 * (G[6 * i + j] + G[6 * j + i]);
  return cholesky_root(n, G, std::numeric_limits<double>::min(), 0.0, R);
}

/// R^-T u, R lower: the force whose response has unit energy along u.
std::array<double, 6> unit_force(int n, const Block& root, const std::array<double, 6>& u) {
  std::array<double, 6> force = u;
  for (int i = n - 1; i >= 0; --i) {
    for (int k = i + 1; k < n; ++k) force[i] -= root[6 * k + i] * force[k];
    force[i] /= root[7 * i];
  }
  return force;
}

}  // namespace

void CoarseSpace::set_pieces(const BlockTree& A, std::span<const char> cut) {
  pieces_.clear();
  cuts_.clear();
  piece_of_.assign(A.n(), -1);
  local_.assign(A.n(), 0);
  offset_ = A.offset;
  for (int i = 0; i < A.n(); ++i) {
    const int p = A.parent[i];
    if (p < 0 || cut[i]) {
      piece_of_[i] = static_cast<int>(pieces_.size());
      pieces_.emplace_back().root = i;
    } else {
      piece_of_[i] = piece_of_[p];
    }
    Piece& piece = pieces_[piece_of_[i]];
    local_[i] = piece.size;
    piece.size += A.dim[i];
    piece.nodes.push_back(i);
    // A cut next to a node without rows couples nothing.
    if (p < 0 || !cut[i] || A.dim[i] == 0 || A.dim[p] == 0) continue;
    piece.parent = piece_of_[p];
    piece.cut = static_cast<int>(cuts_.size());
    pieces_[piece.parent].tails.push_back(piece.cut);
    cuts_.push_back({piece_of_[i], i, piece.parent, p});
  }
  reserve();
}

/// Room for all directions of every cut, so that build() does not allocate.
void CoarseSpace::reserve() {
  std::size_t values = 0;
  for (const Cut& cut : cuts_)
    values +=
        6 * static_cast<std::size_t>(pieces_[cut.piece].size + pieces_[cut.parent_piece].size);
  values_.reserve(values);
  columns_.reserve(12 * cuts_.size());
  coarse_.reserve(12 * cuts_.size());
  forced_.reserve(cuts_.size());
  const auto most = [](const Piece& piece) {
    return 6 * (piece.tails.size() + (piece.parent >= 0 ? 1 : 0));
  };
  matrix_.nodes.assign(pieces_.size(), {});
  for (std::size_t j = 0; j < pieces_.size(); ++j) {
    const Piece& piece = pieces_[j];
    DenseTree::Node& node = matrix_.nodes[j];
    node.parent = piece.parent;
    node.unknowns.reserve(most(piece));
    node.pivot.reserve(most(piece) * most(piece));
    if (piece.parent >= 0) node.inboard.reserve(most(piece) * most(pieces_[piece.parent]));
  }
}

/// responses[k] = J^-1 e_k with a unit force in component k of each of the nodes, one per piece.
void CoarseSpace::respond(const BlockTree& A, TreeFactor& pieces, std::span<const int> nodes,
                          std::array<std::vector<double>, 6>& responses) {
  for (int k = 0; k < 6; ++k) {
    responses[k].assign(A.size(), 0.0);
    bool any = false;
    for (int i : nodes)
      if (A.dim[i] > k) {
        responses[k][A.offset[i] + k] = 1.0;
        any = true;
      }
    if (any) pieces.solve_in_place(responses[k]);
  }
}

void CoarseSpace::add_column(const BlockTree& A, int piece, int node,
                             const std::array<double, 6>& force,
                             const std::array<std::vector<double>, 6>& responses) {
  const std::size_t begin = values_.size();
  values_.resize(begin + pieces_[piece].size, 0.0);
  for (int i : pieces_[piece].nodes) {
    double* const to = values_.data() + begin + local_[i];
    for (int k = 0; k < A.dim[node]; ++k)
      for (int r = 0; r < A.dim[i]; ++r) to[r] += force[k] * responses[k][A.offset[i] + r];
  }
  matrix_.nodes[piece].unknowns.push_back(static_cast<int>(columns_.size()));
  columns_.push_back({node, force, begin});
}

/// Adds the responses of both sides of a cut along the principal directions beyond the threshold.
void CoarseSpace::select(const BlockTree& A, const Cut& cut, double threshold) {
  const int rows = A.dim[cut.root], cols = A.dim[cut.tail];
  Block inner{}, outer{}, root_factor, tail_factor, w{}, square{}, u;
  for (int r = 0; r < rows; ++r)
    for (int k = 0; k < rows; ++k) inner[6 * r + k] = root_responses_[k][A.offset[cut.root] + r];
  for (int r = 0; r < cols; ++r)
    for (int k = 0; k < cols; ++k) outer[6 * r + k] = tail_responses_[k][A.offset[cut.tail] + r];
  if (!regular_root(rows, inner, root_factor) || !regular_root(cols, outer, tail_factor)) return;
  const Block& coupling = A.parent_block[cut.root];
  for (int r = 0; r < rows; ++r)
    for (int k = 0; k < cols; ++k)
      for (int a = r; a < rows; ++a)
        for (int b = k; b < cols; ++b)
          w[6 * r + k] += root_factor[6 * a + r] * coupling[6 * a + b] * tail_factor[6 * b + k];
  for (int r = 0; r < rows; ++r)
    for (int s = 0; s < rows; ++s)
      for (int k = 0; k < cols; ++k) square[6 * r + s] += w[6 * r + k] * w[6 * s + k];
  std::array<double, 6> squares{};
  symmetric_eigen<6>(rows, square.data(), squares.data(), u.data());
  for (int q = 0; q < rows; ++q) {
    if (!(squares[q] > threshold * threshold)) continue;
    std::array<double, 6> left{}, right{};
    for (int r = 0; r < rows; ++r) left[r] = u[6 * r + q];
    for (int k = 0; k < cols; ++k)
      for (int r = 0; r < rows; ++r) right[k] += w[6 * r + k] * left[r] / std::sqrt(squares[q]);
    add_column(A, cut.piece, cut.root, unit_force(rows, root_factor, left), root_responses_);
    add_column(A, cut.parent_piece, cut.tail, unit_force(cols, tail_factor, right),
               tail_responses_);
  }
}

/// E_jj, whose columns are responses J^-1 E f: row a of it is the force f_a on what the others do
/// at its node; and E_jq over the cut towards the base.
void CoarseSpace::assemble(const BlockTree& A, int j) {
  const Piece& piece = pieces_[j];
  DenseTree::Node& node = matrix_.nodes[j];
  const std::vector<int>& own = columns(j);
  const std::size_t m = own.size();
  node.pivot.assign(m * m, 0.0);
  for (std::size_t a = 0; a < m; ++a) {
    const Column& column = columns_[own[a]];
    for (std::size_t b = 0; b < m; ++b) {
      const double* const at = value(own[b], column.node);
      for (int k = 0; k < A.dim[column.node]; ++k) node.pivot[m * a + b] += column.force[k] * at[k];
    }
  }
  if (piece.parent < 0) return;
  const Cut& cut = cuts_[piece.cut];
  const std::vector<int>& others = columns(piece.parent);
  node.inboard.assign(m * others.size(), 0.0);
  for (std::size_t a = 0; a < m; ++a) {
    double force[6] = {};  // on the tail by this column
    block_transpose_multiply_add(A.dim[cut.root], A.dim[cut.tail], A.parent_block[cut.root],
                                 value(own[a], cut.root), force);
    for (std::size_t b = 0; b < others.size(); ++b) {
      const double* const at = value(others[b], cut.tail);
      for (int k = 0; k < A.dim[cut.tail]; ++k)
        node.inboard[others.size() * a + b] += force[k] * at[k];
    }
  }
}

void CoarseSpace::build(const BlockTree& A, TreeFactor& pieces, double threshold) {
  columns_.clear();
  values_.clear();
  for (DenseTree::Node& node : matrix_.nodes) node.unknowns.clear();
  forced_.clear();
  for (const Cut& cut : cuts_) forced_.push_back(cut.root);
  respond(A, pieces, forced_, root_responses_);
  // One tail of every piece at a time: forces in different pieces do not meet.
  for (std::size_t round = 0;; ++round) {
    forced_.clear();
    for (const Piece& piece : pieces_)
      if (piece.tails.size() > round) forced_.push_back(cuts_[piece.tails[round]].tail);
    if (forced_.empty()) break;
    respond(A, pieces, forced_, tail_responses_);
    for (const Piece& piece : pieces_)
      if (piece.tails.size() > round) select(A, cuts_[piece.tails[round]], threshold);
  }
  coarse_.resize(columns_.size());
  for (int j = 0; j < static_cast<int>(pieces_.size()); ++j) assemble(A, j);
  // The columns have unit energy: a pivot at rounding level belongs to one that others span.
  matrix_.factor(1e-13);
}

void CoarseSpace::restrict_all(std::span<const double> r) {
  for (std::size_t j = 0; j < pieces_.size(); ++j)
    for (int column : columns(static_cast<int>(j))) {
      double sum = 0.0;
      const double* from = values_.data() + columns_[column].begin;
      for (int i : pieces_[j].nodes) {
        const int at = offset_[i], dim = offset_[i + 1] - at;
        for (int k = 0; k < dim; ++k) sum += *from++ * r[at + k];
      }
      coarse_[column] = sum;
    }
}

void CoarseSpace::restrict_cuts(const BlockTree& A, std::span<const double> z) {
  std::fill(coarse_.begin(), coarse_.end(), 0.0);
  for (const Cut& cut : cuts_) {
    const int rows = A.dim[cut.root], cols = A.dim[cut.tail];
    double on_root[6] = {}, on_tail[6] = {};
    const Block& coupling = A.parent_block[cut.root];
    block_multiply_add(rows, cols, coupling, z.data() + A.offset[cut.tail], on_root, -1.0);
    block_transpose_multiply_add(rows, cols, coupling, z.data() + A.offset[cut.root], on_tail,
                                 -1.0);
    for (int column : columns(cut.piece))
      for (int k = 0; k < rows; ++k) coarse_[column] += value(column, cut.root)[k] * on_root[k];
    for (int column : columns(cut.parent_piece))
      for (int k = 0; k < cols; ++k) coarse_[column] += value(column, cut.tail)[k] * on_tail[k];
  }
}

void CoarseSpace::prolong_add(std::span<double> x) const {
  for (std::size_t j = 0; j < pieces_.size(); ++j)
    for (int column : columns(static_cast<int>(j))) {
      const double factor = coarse_[column];
      const double* from = values_.data() + columns_[column].begin;
      for (int i : pieces_[j].nodes) {
        const int at = offset_[i], dim = offset_[i + 1] - at;
        for (int k = 0; k < dim; ++k) x[at + k] += factor * *from++;
      }
    }
}

}  // namespace linkwise
