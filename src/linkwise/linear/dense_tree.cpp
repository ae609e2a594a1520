#include "linkwise/linear/dense_tree.hpp"

namespace linkwise {

// Not ldlt.hpp: nodes are wide, and rows may depend on each other.
int DenseTree::factor(double dependent) {
  int left_out = -1;
  for (auto it = nodes.rbegin(); it != nodes.rend(); ++it) {
    const std::size_t m = it->unknowns.size();
    double* const l = it->pivot.data();
    for (std::size_t j = 0; j < m; ++j) {
      const bool kept = l[m * j + j] > dependent;
      const int unknown = it->unknowns[j];
      if (!kept && (left_out < 0 || unknown < left_out)) left_out = unknown;
      const double inverse = kept ? 1.0 / l[m * j + j] : 0.0;
      for (std::size_t i = j + 1; i < m; ++i)
        for (std::size_t k = j + 1; k <= i; ++k)
          l[m * i + k] -= l[m * i + j] * l[m * k + j] * inverse;
      for (std::size_t i = j + 1; i < m; ++i) l[m * i + j] *= inverse;
      l[m * j + j] = inverse;
    }
    if (it->parent < 0) continue;
    Node& into = nodes[it->parent];
    const std::size_t cols = into.unknowns.size();
    double* const e = it->inboard.data();
    for (std::size_t i = 1; i < m; ++i)
      for (std::size_t j = 0; j < i; ++j)
        for (std::size_t k = 0; k < cols; ++k) e[cols * i + k] -= l[m * i + j] * e[cols * j + k];
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t r = 0; r < cols; ++r)
        for (std::size_t k = 0; k < cols; ++k)
          into.pivot[cols * r + k] -= e[cols * i + r] * l[m * i + i] * e[cols * i + k];
  }
  return left_out;
}

double DenseTree::solve_in_place(std::span<double> x) const {
  double energy = 0.0;
  for (auto it = nodes.rbegin(); it != nodes.rend(); ++it) {
    const std::vector<int>& own = it->unknowns;
    const std::size_t m = own.size();
    for (std::size_t i = 1; i < m; ++i)
      for (std::size_t j = 0; j < i; ++j) x[own[i]] -= it->pivot[m * i + j] * x[own[j]];
    for (std::size_t i = 0; i < m; ++i) {
      const double scaled = x[own[i]] * it->pivot[m * i + i];
      energy += x[own[i]] * scaled;
      x[own[i]] = scaled;
    }
    if (it->parent < 0) continue;
    const std::vector<int>& others = nodes[it->parent].unknowns;
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t k = 0; k < others.size(); ++k)
        x[others[k]] -= it->inboard[others.size() * i + k] * x[own[i]];
  }
  for (const Node& node : nodes) {
    const std::vector<int>& own = node.unknowns;
    const std::size_t m = own.size();
    if (node.parent >= 0) {
      const std::vector<int>& others = nodes[node.parent].unknowns;
      for (std::size_t i = 0; i < m; ++i) {
        double sum = 0.0;
        for (std::size_t k = 0; k < others.size(); ++k)
          sum += node.inboard[others.size() * i + k] * x[others[k]];
        x[own[i]] -= node.pivot[m * i + i] * sum;
      }
    }
    for (std::size_t i = m; i-- > 1;)
      for (std::size_t j = 0; j < i; ++j) x[own[j]] -= node.pivot[m * i + j] * x[own[i]];
  }
  return energy;
}

}  // namespace linkwise
