// Products of a ScaledTree with a vector, whole and row by row.

#include <algorithm>

#include "linkwise/linear/scaled_tree.hpp"

namespace linkwise {

template <bool all>
void ScaledTree::couple_hub(const Hub& body, const double* x, double* y, const char* selected,
                            char value) const {
  double sum[6] = {};
  for (int i : body.children)
    block_transpose_multiply_add(dim[i], 6, levers[lever_of[i]], x + offset[i], sum);
  const int p = body.node;
  if (all || selected[p] == value)
    block_multiply_add(dim[p], 6, body.inboard, sum, y + offset[p], -1.0);
  block_transpose_multiply_add(dim[p], 6, body.inboard, x + offset[p], sum, -1.0);
  for (int i : body.children) {
    if (!all && selected[i] != value) continue;
    const Block& lever = levers[lever_of[i]];
    with_dim(dim[i], [&](auto d) {
      double others[6];
      std::copy(sum, sum + 6, others);
      block_transpose_multiply_add<d.n, 6>(lever.data(), x + offset[i], others, -1.0);
      block_multiply_add<d.n, 6>(lever.data(), others, y + offset[i], 1.0);
    });
  }
}

template <bool all>
void ScaledTree::couple(const double* x, double* y, const char* selected, char value) const {
  const int count = n();
  for (int i = 0; i < count; ++i) {
    const int p = lever_of[i] < 0 ? parent[i] : -1;
    if (p < 0) continue;
    const bool to_child = all || selected[i] == value;
    const bool to_parent = all || selected[p] == value;
    with_dims(dim[i], dim[p], [&](auto r, auto c) {
      const double* b = coupling[i].data();
      if (to_child) block_multiply_add<r.n, c.n>(b, x + offset[p], y + offset[i], 1.0);
      if (to_parent) block_transpose_multiply_add<r.n, c.n>(b, x + offset[i], y + offset[p], 1.0);
    });
  }
  for (const Hub& body : hubs) couple_hub<all>(body, x, y, selected, value);
}

void ScaledTree::multiply(std::span<const double> x, std::span<double> y) const {
  std::copy(x.begin(), x.end(), y.begin());
  couple<true>(x.data(), y.data(), nullptr, 0);
}

void ScaledTree::add_coupling(std::span<const double> x, std::span<double> y,
                              std::span<const char> selected, char value) const {
  couple<false>(x.data(), y.data(), selected.data(), value);
}

void ScaledTree::hub_sums(std::span<const double> x, std::span<double> sums) const {
  std::fill(sums.begin(), sums.end(), 0.0);
  for (std::size_t h = 0; h < hubs.size(); ++h) {
    double* const sum = sums.data() + 6 * h;
    const int p = hubs[h].node;
    for (int i : hubs[h].children)
      block_transpose_multiply_add(dim[i], 6, levers[lever_of[i]], x.data() + offset[i], sum);
    block_transpose_multiply_add(dim[p], 6, hubs[h].inboard, x.data() + offset[p], sum, -1.0);
  }
}

void ScaledTree::subtract_row(int i, const double* x, const double* sums, double* row) const {
  const int p = parent[i];
  if (lever_of[i] >= 0) {
    // The sum holds the node's own part, which belongs to the diagonal.
    const Block& lever = levers[lever_of[i]];
    double others[6];
    std::copy(sums + 6 * hub[p], sums + 6 * hub[p] + 6, others);
    block_transpose_multiply_add(dim[i], 6, lever, x + offset[i], others, -1.0);
    block_multiply_add(dim[i], 6, lever, others, row, -1.0);
  } else if (p >= 0) {
    block_multiply_add(dim[i], dim[p], coupling[i], x + offset[p], row, -1.0);
  }
  if (const int child = only_child[i]; child >= 0) {
    block_transpose_multiply_add(dim[child], dim[i], coupling[child], x + offset[child], row, -1.0);
  } else if (hub[i] >= 0) {
    const Block& inboard = hubs[hub[i]].inboard;
    double children[6];
    std::copy(sums + 6 * hub[i], sums + 6 * hub[i] + 6, children);
    block_transpose_multiply_add(dim[i], 6, inboard, x + offset[i], children);
    block_multiply_add(dim[i], 6, inboard, children, row);
  }
}

void ScaledTree::update_sums(int i, const double* change, double* sums) const {
  if (lever_of[i] >= 0)
    block_transpose_multiply_add(dim[i], 6, levers[lever_of[i]], change, sums + 6 * hub[parent[i]]);
  if (hub[i] >= 0)
    block_transpose_multiply_add(dim[i], 6, hubs[hub[i]].inboard, change, sums + 6 * hub[i], -1.0);
}

}  // namespace linkwise
