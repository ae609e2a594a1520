#pragma once
// The slow, obvious twin of every solver: the block tree as a dense matrix, cliques and all, and
// Cholesky on it in long double.

#include <cmath>
#include <vector>

#include "linkwise/linear/block_tree.hpp"

namespace linkwise::testing {

struct Dense {
  int size = 0;
  std::vector<double> a;
  double& at(int i, int j) { return a[static_cast<std::size_t>(size) * i + j]; }
  double at(int i, int j) const { return a[static_cast<std::size_t>(size) * i + j]; }
};

inline void set_coupling(Dense& dense, const BlockTree& tree, int i, int j, const Block& block) {
  for (int r = 0; r < tree.dim[i]; ++r)
    for (int c = 0; c < tree.dim[j]; ++c) {
      dense.at(tree.offset[i] + r, tree.offset[j] + c) = block[6 * r + c];
      dense.at(tree.offset[j] + c, tree.offset[i] + r) = block[6 * r + c];
    }
}

/// sign * left C right^T.
inline Block through_body(const Block& left, const Block& c, const Block& right, double sign) {
  Block out{};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (int k = 0; k < 6; ++k)
        for (int l = 0; l < 6; ++l)
          out[6 * i + j] += sign * left[6 * i + k] * c[6 * k + l] * right[6 * j + l];
  return out;
}

inline Dense dense_twin(const BlockTree& tree) {
  Dense dense;
  dense.size = tree.size();
  dense.a.assign(static_cast<std::size_t>(dense.size) * dense.size, 0.0);
  for (int i = 0; i < tree.n(); ++i) {
    set_coupling(dense, tree, i, i, tree.diag[i]);
    if (tree.parent[i] >= 0 && tree.lever_of[i] < 0)
      set_coupling(dense, tree, i, tree.parent[i], tree.parent_block[i]);
  }
  for (const BlockTree::Hub& body : tree.hubs)
    for (int i : body.children) {
      const Block& lever = tree.levers[tree.lever_of[i]];
      set_coupling(dense, tree, i, body.node,
                   through_body(lever, body.compliance, body.inboard, -1.0));
      for (int s : body.children)
        if (s < i)
          set_coupling(dense, tree, i, s,
                       through_body(lever, body.compliance, tree.levers[tree.lever_of[s]], 1.0));
    }
  return dense;
}

inline std::vector<double> multiply(const Dense& dense, const std::vector<double>& x) {
  std::vector<double> y(dense.size);
  for (int i = 0; i < dense.size; ++i) {
    long double sum = 0.0L;
    for (int j = 0; j < dense.size; ++j) sum += static_cast<long double>(dense.at(i, j)) * x[j];
    y[i] = static_cast<double>(sum);
  }
  return y;
}

/// Dense Cholesky in long double; empty when the matrix is not positive definite.
inline std::vector<double> cholesky_solve(const Dense& dense, const std::vector<double>& b) {
  const int n = dense.size;
  std::vector<long double> l(static_cast<std::size_t>(n) * n, 0.0L), y(n);
  const auto at = [&](int i, int j) -> long double& {
    return l[static_cast<std::size_t>(n) * i + j];
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) {
      long double sum = dense.at(i, j);
      for (int k = 0; k < j; ++k) sum -= at(i, k) * at(j, k);
      if (i == j && !(sum > 0.0L)) return {};
      at(i, j) = i == j ? std::sqrt(sum) : sum / at(j, j);
    }
  for (int i = 0; i < n; ++i) {
    y[i] = b[i];
    for (int k = 0; k < i; ++k) y[i] -= at(i, k) * y[k];
    y[i] /= at(i, i);
  }
  for (int i = n - 1; i >= 0; --i) {
    for (int k = i + 1; k < n; ++k) y[i] -= at(k, i) * y[k];
    y[i] /= at(i, i);
  }
  return {y.begin(), y.end()};
}

/// ||x - y||_A / ||y||_A.
inline double energy_error(const Dense& dense, const std::vector<double>& x,
                           const std::vector<double>& y) {
  std::vector<double> e(x.size());
  for (std::size_t i = 0; i < e.size(); ++i) e[i] = x[i] - y[i];
  const std::vector<double> ae = multiply(dense, e), ay = multiply(dense, y);
  long double top = 0.0L, bottom = 0.0L;
  for (std::size_t i = 0; i < e.size(); ++i) {
    top += static_cast<long double>(e[i]) * ae[i];
    bottom += static_cast<long double>(y[i]) * ay[i];
  }
  if (bottom == 0.0L) return static_cast<double>(std::sqrt(top));
  return static_cast<double>(std::sqrt(top / bottom));
}

}  // namespace linkwise::testing
