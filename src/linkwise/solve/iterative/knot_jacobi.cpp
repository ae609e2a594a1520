#include "linkwise/solve/iterative/knot_jacobi.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linkwise/base/packed.hpp"
#include "linkwise/base/symmetric_eigen.hpp"
#include "linkwise/exec/tiles.hpp"
#include "linkwise/simd/cholesky.hpp"

namespace linkwise {
namespace {

/// Rows of a body up to which its spectrum is worked out; an elastic one with more has dependent
/// rows.
constexpr int most_rows = 12;

double* row_of(std::vector<double>& packed_blocks, int i) {
  return &packed_blocks[21 * static_cast<std::size_t>(i)];
}
const double* row_of(const std::vector<double>& packed_blocks, int i) {
  return &packed_blocks[21 * static_cast<std::size_t>(i)];
}

bool is_elastic(const BlockGraph& A, int hub) { return A.width(hub) > 6; }

/// Rows of a knot that is factored as one matrix, at most; pivots of it that are too small, over
/// what they came from: such rows repeat each other.
constexpr int most_dense_rows = 96;
constexpr double repeated = 1e-10;

struct Ends {
  int rows = 0;
  bool on_rigid = false, on_elastic = false, on_ground = false;  ///< some of them
};

/// Where joints of a hub end besides.
Ends ends_of(const BlockGraph& A, int hub) {
  Ends out;
  for (int e = A.hub_begin[hub]; e < A.hub_begin[hub + 1]; ++e) {
    const int i = A.end_node[e];
    if (A.dim(i) == 0) continue;
    out.rows += A.dim(i);
    out.on_ground |= A.node_begin[i + 1] - A.node_begin[i] == 1;
    for (int at = A.node_begin[i]; at < A.node_begin[i + 1]; ++at) {
      const int other = A.end_hub[A.node_ends[at]];
      if (other != hub) (is_elastic(A, other) ? out.on_elastic : out.on_rigid) = true;
    }
  }
  return out;
}

}  // namespace

void KnotJacobi::find_knots(const BlockGraph& A) {
  knots_.clear();
  is_in_knot_.assign(A.n(), in_none);
  held_.clear();
  for (int k = 0; k < A.n_hubs(); ++k) {
    if (is_elastic(A, k)) continue;
    const Ends ends = ends_of(A, k);
    if (!ends.on_elastic || ends.on_rigid) continue;
    if (ends.on_ground && ends.rows > most_dense_rows) continue;
    if (ends.on_ground)
      held_.push_back({k, ends.rows, {}});
    else
      knots_.push_back(k);
    for (int e = A.hub_begin[k]; e < A.hub_begin[k + 1]; ++e)
      is_in_knot_[A.end_node[e]] = ends.on_ground ? in_held : in_free;
  }
}

int KnotJacobi::factor(const BlockGraph& A) {
  find_knots(A);
  std::erase_if(held_, [&](Held& knot) {
    if (factor_held(A, knot)) return false;
    for (int e = A.hub_begin[knot.hub]; e < A.hub_begin[knot.hub + 1]; ++e)
      is_in_knot_[A.end_node[e]] = in_none;
    return true;
  });
  block_.resize(21 * static_cast<std::size_t>(A.n()));
  for (int i = 0; i < A.n(); ++i) {
    if (is_in_knot_[i] == in_held) continue;
    double* const L = row_of(block_, i);
    const int rows = A.dim(i);
    calc_elastic_part(A, i, L);
    if (rows == 1 && L[0] == 0) L[0] = 1;  // a row that holds nothing
    if (!cholesky_factor(rows, L, 0.0)) return i;
  }
  inner_.resize(21 * knots_.size());
  for (int at = 0; at < static_cast<int>(knots_.size()); ++at)
    if (!factor_knot(A, at)) return A.end_node[A.hub_begin[knots_[at]]];
  return -1;
}

/// A node's block but for what a knot adds to it.
void KnotJacobi::calc_elastic_part(const BlockGraph& A, int i, double* block) const {
  for (int r = 0; r < A.dim(i); ++r)
    for (int c = 0; c <= r; ++c) block[packed(r, c)] = r == c ? A.own[A.offset[i] + r] : 0.0;
  for (int at = A.node_begin[i]; at < A.node_begin[i + 1]; ++at)
    if (const int e = A.node_ends[at]; !is_in_knot_[i] || is_elastic(A, A.end_hub[e]))
      A.add_to_diagonal(e, block);
}

/// P itself: joints with the ground have no elastic end, and so no D^-1.
bool KnotJacobi::factor_held(const BlockGraph& A, Held& knot) {
  const double* const C = A.compliance(knot.hub);
  knot.L.assign(static_cast<std::size_t>(knot.rows) * (knot.rows + 1) / 2, 0.0);
  std::vector<const double*> levers;
  for (int e = A.hub_begin[knot.hub]; e < A.hub_begin[knot.hub + 1]; ++e) {
    const int node = A.end_node[e], first = static_cast<int>(levers.size());
    double own[21];
    calc_elastic_part(A, node, own);
    for (int r = 0; r < A.dim(node); ++r) {
      levers.push_back(A.levers.data() + A.lever_begin[e] + 6 * std::size_t(r));
      for (int c = 0; c <= r; ++c) knot.L[packed(first + r, first + c)] = own[packed(r, c)];
    }
  }
  for (int j = 0; j < knot.rows; ++j) {
    double y[6] = {};
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c) y[r] += C[6 * r + c] * levers[j][c];
    for (int i = j; i < knot.rows; ++i)
      for (int c = 0; c < 6; ++c) knot.L[packed(i, j)] += levers[i][c] * y[c];
  }
  return cholesky_factor(knot.rows, knot.L.data(), repeated);
}

void KnotJacobi::solve_held(const BlockGraph& A, const Held& knot, std::span<double> z) const {
  double x[most_dense_rows];
  const auto each = [&](auto&& f) {
    int at = 0;
    for (int e = A.hub_begin[knot.hub]; e < A.hub_begin[knot.hub + 1]; ++e)
      for (int i = A.offset[A.end_node[e]]; i < A.offset[A.end_node[e] + 1]; ++i) f(x[at++], z[i]);
  };
  each([](double& to, const double& from) { to = from; });
  cholesky_solve(knot.rows, knot.L.data(), x);
  each([](const double& from, double& to) { to = from; });
}

bool KnotJacobi::factor_knot(const BlockGraph& A, int at) {
  const int k = knots_[at];
  double C[21];
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) C[packed(i, j)] = A.compliance(k)[6 * i + j];
  if (!cholesky_factor(6, C, 0.0)) return false;
  double* const inner = row_of(inner_, at);
  for (int j = 0; j < 6; ++j) {
    double unit[6] = {};
    unit[j] = 1;
    cholesky_solve(6, C, unit);
    for (int i = j; i < 6; ++i) inner[packed(i, j)] = unit[i];
  }
  for (int e = A.hub_begin[k]; e < A.hub_begin[k + 1]; ++e) {
    const int node = A.end_node[e], rows = A.dim(node);
    const double* const H = A.levers.data() + A.lever_begin[e];
    for (int j = 0; j < 6; ++j) {
      double y[6] = {};
      for (int r = 0; r < rows; ++r) y[r] = H[6 * r + j];
      cholesky_solve(rows, row_of(block_, node), y);
      for (int i = j; i < 6; ++i)
        for (int r = 0; r < rows; ++r) inner[packed(i, j)] += H[6 * r + i] * y[r];
    }
  }
  return cholesky_factor(6, inner, 0.0);
}

void KnotJacobi::solve(const BlockGraph& A, std::span<const double> r, std::span<double> z,
                       const Executor& executor) const {
  std::copy(r.begin(), r.end(), z.begin());
  Tiles(A.n(), TileOf::nodes).for_each(executor, [&](int, int begin, int end) {
    for (int i = begin; i < end; ++i)
      if (is_in_knot_[i] != in_held)
        cholesky_solve(A.dim(i), row_of(block_, i), z.data() + A.offset[i]);
  });
  const int n = static_cast<int>(knots_.size());
  Tiles(n, TileOf::nodes).for_each(executor, [&](int, int begin, int end) {
    for (int at = begin; at < end; ++at) solve_knot(A, at, z);
  });
  for (const Held& knot : held_) solve_held(A, knot, z);
}

/// z holds D^-1 r.
void KnotJacobi::solve_knot(const BlockGraph& A, int at, std::span<double> z) const {
  const int k = knots_[at];
  double t[6] = {};
  for (int e = A.hub_begin[k]; e < A.hub_begin[k + 1]; ++e) {
    const double* H = A.levers.data() + A.lever_begin[e];
    for (int i = A.offset[A.end_node[e]]; i < A.offset[A.end_node[e] + 1]; ++i, H += 6)
      for (int c = 0; c < 6; ++c) t[c] += H[c] * z[i];
  }
  cholesky_solve(6, row_of(inner_, at), t);
  for (int e = A.hub_begin[k]; e < A.hub_begin[k + 1]; ++e) {
    const int node = A.end_node[e], rows = A.dim(node);
    const double* const H = A.levers.data() + A.lever_begin[e];
    double y[6] = {};
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < 6; ++c) y[r] += H[6 * r + c] * t[c];
    cholesky_solve(rows, row_of(block_, node), y);
    for (int r = 0; r < rows; ++r) z[A.offset[node] + r] -= y[r];
  }
}

KnotJacobi::Bound KnotJacobi::bound(const BlockGraph& A) const {
  Bound out;
  std::vector<char> is_whole(A.n_hubs());
  for (const int k : knots_) is_whole[k] = 1;
  for (const Held& knot : held_) is_whole[knot.hub] = 1;
  for (int k = 0; k < A.n_hubs(); ++k) {
    if (is_whole[k]) continue;
    // H where D_b is 1.
    const int width = A.width(k);
    std::vector<double> levers;
    int rows = 0, ends = 0;
    for (int e = A.hub_begin[k]; e < A.hub_begin[k + 1]; ++e) {
      const int own_rows = A.dim(A.end_node[e]);
      if (own_rows == 0) continue;
      double L[21] = {};
      A.add_to_diagonal(e, L);
      if (!cholesky_factor(own_rows, L, 1e-14)) return {0, std::numeric_limits<double>::infinity()};
      const double* const H = A.levers.data() + A.lever_begin[e];
      const std::size_t first = levers.size();
      levers.insert(levers.end(), H, H + static_cast<std::size_t>(width) * own_rows);
      double* const to = levers.data() + first;
      for (int r = 0; r < own_rows; ++r) {
        for (int l = 0; l < r; ++l)
          for (int c = 0; c < width; ++c) to[width * r + c] -= L[packed(r, l)] * to[width * l + c];
        for (int c = 0; c < width; ++c) to[width * r + c] *= L[packed(r, r)];
      }
      rows += own_rows;
      ++ends;
    }
    if (ends < 2) continue;  // A_b is D_b
    // A_b <= ends * D_b always. Its rank is at most the hub's width.
    if (rows > std::min(width, most_rows)) {
      out.smallest = 0;
      out.largest = std::max(out.largest, static_cast<double>(ends));
      continue;
    }
    double a[most_rows * most_rows] = {}, values[most_rows], vectors[most_rows * most_rows];
    for (int j = 0; j < rows; ++j) {
      double y[12] = {};
      for (int r = 0; r < width; ++r)
        for (int c = 0; c < width; ++c)
          y[r] += A.compliance(k)[width * r + c] * levers[width * j + c];
      for (int i = 0; i < rows; ++i)
        for (int c = 0; c < width; ++c) a[most_rows * i + j] += levers[width * i + c] * y[c];
    }
    symmetric_eigen<most_rows>(rows, a, values, vectors);
    const auto [least, most] = std::minmax_element(values, values + rows);
    // A rank that is short shows as rounding.
    out.smallest = std::min(out.smallest, *least > 1e-9 ? *least : 0.0);
    out.largest = std::max(out.largest, *most);
  }
  return out;
}

double KnotJacobi::Bound::iterations(double tolerance) const {
  if (!(smallest > 0)) return std::numeric_limits<double>::infinity();
  const double root = std::sqrt(largest / smallest);
  if (root <= 1) return 1;
  return std::ceil(std::log(2 / tolerance) / std::log((root + 1) / (root - 1)));
}

}  // namespace linkwise
