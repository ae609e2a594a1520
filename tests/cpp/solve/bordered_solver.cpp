#include "solve/bordered_solver.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace linkwise {

/// Factors S, scaled to a unit diagonal of E; the first dependent row, or -1.
int BorderedSolver::eliminate(const BorderedSystem& A) {
  constexpr double dependent = 1e-12;
  const std::size_t n = A.forest.size(), m = A.border.size();
  schur_.nodes.resize(1);
  DenseTree::Node& node = schur_.nodes[0];
  node.unknowns.resize(m);
  std::iota(node.unknowns.begin(), node.unknowns.end(), 0);
  node.pivot.resize(m * m);
  for (std::size_t k = 0; k < m; ++k) root_[k] = std::sqrt(A.corner[m * k + k]);
  for (std::size_t k = 0; k < m; ++k)
    for (std::size_t l = 0; l <= k; ++l) {
      const std::span<const double> column(z_.data() + n * l, n);
      const double entry = A.corner[m * k + l] - A.border_product(static_cast<int>(k), column);
      node.pivot[m * k + l] = entry / (root_[k] * root_[l]);
    }
  return schur_.factor(dependent);
}

Report BorderedSolver::solve(const BorderedSystem& A, std::span<const double> b,
                             std::span<double> x) {
  const std::size_t n = A.forest.size(), m = A.border.size();
  if (m == 0) return forest_->solve(A.forest, b, x);
  for (std::vector<double>* v : {&right_, &z_}) v->assign((m + 1) * n, 0.0);
  for (std::vector<double>* v : {&root_, &y_}) v->resize(m);
  for (std::size_t k = 0; k < m; ++k)
    A.add_border_row(static_cast<int>(k), 1.0, std::span(right_).subspan(n * k, n));
  std::copy(b.begin(), b.begin() + n, right_.begin() + n * m);
  std::copy(x.begin(), x.begin() + n, z_.begin() + n * m);
  Report report = forest_->solve_many(A.forest, static_cast<int>(m) + 1, right_, z_);
  if (!report.ok()) return report;
  const int dependent = eliminate(A);
  const std::span<const double> free(z_.data() + n * m, n);
  for (std::size_t k = 0; k < m; ++k)
    y_[k] = (b[n + k] - A.border_product(static_cast<int>(k), free)) / root_[k];
  schur_.solve_in_place(y_);
  std::copy(free.begin(), free.end(), x.begin());
  for (std::size_t k = 0; k < m; ++k) {
    x[n + k] = y_[k] / root_[k];
    for (std::size_t i = 0; i < n; ++i) x[i] -= x[n + k] * z_[n * k + i];
  }
  if (dependent >= 0) {
    report.outcome = Outcome::not_positive_definite;
    report.node = A.forest.n() + dependent;
  }
  return report;
}

bool BorderedSolver::depends(int row) const {
  const DenseTree::Node& node = schur_.nodes[0];
  return node.pivot[node.unknowns.size() * row + row] == 0.0;
}

}  // namespace linkwise
