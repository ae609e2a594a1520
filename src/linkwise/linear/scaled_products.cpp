// Products of a ScaledTree with a vector, whole and row by row.

#include <algorithm>

#include "linkwise/linear/scaled_tree.hpp"

namespace linkwise {

template <class Selected>
void ScaledTree::add_rows(std::span<const double> x, std::span<double> y,
                          Selected&& selected) const {
  hub_sums(x, hub_sums_);
  for_each_node([&](int i) {
    if (selected(i)) add_row(i, x.data(), hub_sums_.data(), y.data() + offset[i], 1.0);
  });
}

void ScaledTree::multiply(std::span<const double> x, std::span<double> y) const {
  add_rows(x, y, [&](int i) {
    std::copy(x.data() + offset[i], x.data() + offset[i + 1], y.data() + offset[i]);
    return true;
  });
}

void ScaledTree::add_coupling(std::span<const double> x, std::span<double> y,
                              std::span<const char> selected, char value) const {
  add_rows(x, y, [&](int i) { return selected[i] == value; });
}

void ScaledTree::hub_sums(std::span<const double> x, std::span<double> sums) const {
  const Tiles tiles(static_cast<int>(hubs.size()), TileOf::nodes);
  tiles.for_each(executor_, [&](int, int begin, int end) {
    for (int h = begin; h < end; ++h) {
      double* const sum = sums.data() + 6 * h;
      std::fill(sum, sum + 6, 0.0);
      const int p = hubs[h].node;
      for (int i : hubs[h].children)
        block_transpose_multiply_add(dim[i], 6, levers[lever_of[i]], x.data() + offset[i], sum);
      block_transpose_multiply_add(dim[p], 6, hubs[h].inboard, x.data() + offset[p], sum, -1.0);
    }
  });
}

void ScaledTree::add_row(int i, const double* x, const double* sums, double* row,
                         double sign) const {
  const int p = parent[i];
  if (lever_of[i] >= 0) {
    // The sum holds the node's own part, which belongs to the diagonal.
    const Block& lever = levers[lever_of[i]];
    double others[6];
    std::copy(sums + 6 * hub[p], sums + 6 * hub[p] + 6, others);
    block_transpose_multiply_add(dim[i], 6, lever, x + offset[i], others, -1.0);
    block_multiply_add(dim[i], 6, lever, others, row, sign);
  } else if (p >= 0) {
    block_multiply_add(dim[i], dim[p], coupling[i], x + offset[p], row, sign);
  }
  if (const int child = only_child[i]; child >= 0) {
    block_transpose_multiply_add(dim[child], dim[i], coupling[child], x + offset[child], row, sign);
  } else if (hub[i] >= 0) {
    const Block& inboard = hubs[hub[i]].inboard;
    double children[6];
    std::copy(sums + 6 * hub[i], sums + 6 * hub[i] + 6, children);
    block_transpose_multiply_add(dim[i], 6, inboard, x + offset[i], children);
    block_multiply_add(dim[i], 6, inboard, children, row, -sign);
  }
}

void ScaledTree::update_sums(int i, const double* change, double* sums) const {
  if (lever_of[i] >= 0)
    block_transpose_multiply_add(dim[i], 6, levers[lever_of[i]], change, sums + 6 * hub[parent[i]]);
  if (hub[i] >= 0)
    block_transpose_multiply_add(dim[i], 6, hubs[hub[i]].inboard, change, sums + 6 * hub[i], -1.0);
}

}  // namespace linkwise
