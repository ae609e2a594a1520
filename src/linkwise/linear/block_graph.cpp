#include "linkwise/linear/block_graph.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/base/finite.hpp"
#include "linkwise/base/packed.hpp"
#include "linkwise/exec/tiles.hpp"

namespace linkwise {

void BlockGraph::set_structure(std::span<const int> dims,
                               std::span<const std::vector<int>> hubs_of) {
  const int nodes = static_cast<int>(dims.size());
  int hubs = 0;
  offset.assign(1, 0);
  node_begin.assign(1, 0);
  for (int i = 0; i < nodes; ++i) {
    offset.push_back(offset.back() + dims[i]);
    node_begin.push_back(node_begin.back() + static_cast<int>(hubs_of[i].size()));
    for (const int k : hubs_of[i]) hubs = std::max(hubs, k + 1);
  }
  hub_begin.assign(hubs + 1, 0);
  for (const std::vector<int>& own_hubs : hubs_of)
    for (const int k : own_hubs) ++hub_begin[k + 1];
  for (int k = 0; k < hubs; ++k) hub_begin[k + 1] += hub_begin[k];
  const auto ends = static_cast<std::size_t>(hub_begin[hubs]);
  end_node.resize(ends);
  end_hub.resize(ends);
  node_ends.resize(ends);
  lever_begin.resize(ends);
  std::vector<int> next(hub_begin.begin(), hub_begin.end() - 1);
  std::size_t at = 0;
  for (int i = 0; i < nodes; ++i)
    for (std::size_t which = 0; which < hubs_of[i].size(); ++which) {
      const int k = hubs_of[i][which], e = next[k]++;
      end_node[e] = i;
      end_hub[e] = k;
      node_ends[node_begin[i] + which] = e;
    }
  for (std::size_t e = 0; e < ends; ++e) {
    lever_begin[e] = at;
    at += 6 * static_cast<std::size_t>(dims[end_node[e]]);
  }
  levers.assign(at, 0.0);
  compliance.assign(hubs, Block{});
  own.assign(offset.back(), 0.0);
}

void BlockGraph::multiply(std::span<const double> x, std::span<double> y,
                          std::vector<double>& motions, const Executor& executor) const {
  motions.resize(6 * static_cast<std::size_t>(n_hubs()));
  Tiles(n_hubs(), TileOf::nodes).for_each(executor, [&](int, int begin, int end) {
    for (int k = begin; k < end; ++k) {
      double w[6] = {};
      for (int e = hub_begin[k]; e < hub_begin[k + 1]; ++e) {
        const double* row = levers.data() + lever_begin[e];
        for (int i = offset[end_node[e]]; i < offset[end_node[e] + 1]; ++i, row += 6)
          for (int c = 0; c < 6; ++c) w[c] += row[c] * x[i];
      }
      double* const a = &motions[6 * static_cast<std::size_t>(k)];
      for (int r = 0; r < 6; ++r) {
        a[r] = 0;
        for (int c = 0; c < 6; ++c) a[r] += compliance[k][6 * r + c] * w[c];
      }
    }
  });
  Tiles(n(), TileOf::nodes).for_each(executor, [&](int, int begin, int end) {
    for (int i = begin; i < end; ++i) {
      for (int r = offset[i]; r < offset[i + 1]; ++r) y[r] = own[r] * x[r];
      for (int at = node_begin[i]; at < node_begin[i + 1]; ++at) {
        const int e = node_ends[at];
        const double* row = levers.data() + lever_begin[e];
        const double* const a = &motions[6 * static_cast<std::size_t>(end_hub[e])];
        for (int r = offset[i]; r < offset[i + 1]; ++r, row += 6)
          for (int c = 0; c < 6; ++c) y[r] += row[c] * a[c];
      }
    }
  });
}

void BlockGraph::calc_diagonal(int node, double* packed_lower) const {
  const int rows = dim(node);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c <= r; ++c) packed_lower[packed(r, c)] = r == c ? own[offset[node] + r] : 0.0;
  for (int at = node_begin[node]; at < node_begin[node + 1]; ++at) {
    const int e = node_ends[at];
    const Block& C = compliance[end_hub[e]];
    const double* const H = levers.data() + lever_begin[e];
    for (int c = 0; c < rows; ++c) {
      double y[6] = {};
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) y[i] += C[6 * i + j] * H[6 * c + j];
      for (int r = c; r < rows; ++r)
        for (int i = 0; i < 6; ++i) packed_lower[packed(r, c)] += H[6 * r + i] * y[i];
    }
  }
}

bool BlockGraph::all_finite() const {
  if (!linkwise::all_finite(levers) || !linkwise::all_finite(own)) return false;
  return std::all_of(compliance.begin(), compliance.end(),
                     [](const Block& C) { return linkwise::all_finite(C); });
}

}  // namespace linkwise
