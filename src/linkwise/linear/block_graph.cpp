#include "linkwise/linear/block_graph.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/base/finite.hpp"
#include "linkwise/base/packed.hpp"
#include "linkwise/exec/tiles.hpp"

namespace linkwise {

void BlockGraph::set_structure(std::span<const int> dims, std::span<const std::vector<int>> hubs_of,
                               const std::vector<char>& is_wide) {
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
  motion_begin.assign(1, 0);
  compliance_begin.clear();
  std::size_t numbers = 0;
  for (int k = 0; k < hubs; ++k) {
    const int wide = k < static_cast<int>(is_wide.size()) && is_wide[k] ? 12 : 6;
    motion_begin.push_back(motion_begin.back() + wide);
    compliance_begin.push_back(numbers);
    numbers += static_cast<std::size_t>(wide) * wide;
  }
  for (std::size_t e = 0; e < ends; ++e) {
    lever_begin[e] = at;
    at += static_cast<std::size_t>(width(end_hub[e])) * dims[end_node[e]];
  }
  levers.assign(at, 0.0);
  compliances.assign(numbers, 0.0);
  own.assign(offset.back(), 0.0);
}

void BlockGraph::multiply(std::span<const double> x, std::span<double> y,
                          std::vector<double>& motions, const Executor& executor) const {
  motions.resize(motion_begin.back());
  Tiles(n_hubs(), TileOf::nodes).for_each(executor, [&](int, int begin, int end) {
    for (int k = begin; k < end; ++k)
      with_width(width(k), [&](auto w) {
        double wrench[w] = {};
        for (int e = hub_begin[k]; e < hub_begin[k + 1]; ++e) {
          const double* row = levers.data() + lever_begin[e];
          for (int i = offset[end_node[e]]; i < offset[end_node[e] + 1]; ++i, row += w)
            for (int c = 0; c < w; ++c) wrench[c] += row[c] * x[i];
        }
        const double* const C = compliance(k);
        double* const a = &motions[motion_begin[k]];
        for (int r = 0; r < w; ++r) {
          a[r] = 0;
          for (int c = 0; c < w; ++c) a[r] += C[w * r + c] * wrench[c];
        }
      });
  });
  Tiles(n(), TileOf::nodes).for_each(executor, [&](int, int begin, int end) {
    for (int i = begin; i < end; ++i) {
      for (int r = offset[i]; r < offset[i + 1]; ++r) y[r] = own[r] * x[r];
      for (int at = node_begin[i]; at < node_begin[i + 1]; ++at) {
        const int e = node_ends[at];
        with_width(width(end_hub[e]), [&](auto w) {
          const double* row = levers.data() + lever_begin[e];
          const double* const a = &motions[motion_begin[end_hub[e]]];
          for (int r = offset[i]; r < offset[i + 1]; ++r, row += w)
            for (int c = 0; c < w; ++c) y[r] += row[c] * a[c];
        });
      }
    }
  });
}

void BlockGraph::calc_diagonal(int node, double* packed_lower) const {
  const int rows = dim(node);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c <= r; ++c) packed_lower[packed(r, c)] = r == c ? own[offset[node] + r] : 0.0;
  for (int at = node_begin[node]; at < node_begin[node + 1]; ++at)
    add_to_diagonal(node_ends[at], packed_lower);
}

void BlockGraph::add_to_diagonal(int end, double* packed_lower) const {
  const int rows = dim(end_node[end]);
  const double* const C = compliance(end_hub[end]);
  const double* const H = levers.data() + lever_begin[end];
  with_width(width(end_hub[end]), [&](auto w) {
    for (int c = 0; c < rows; ++c) {
      double y[w] = {};
      for (int i = 0; i < w; ++i)
        for (int j = 0; j < w; ++j) y[i] += C[w * i + j] * H[w * c + j];
      for (int r = c; r < rows; ++r)
        for (int i = 0; i < w; ++i) packed_lower[packed(r, c)] += H[w * r + i] * y[i];
    }
  });
}

bool BlockGraph::all_finite() const {
  return linkwise::all_finite(levers) && linkwise::all_finite(own) &&
         linkwise::all_finite(compliances);
}

}  // namespace linkwise
