#include "linkwise/linear/block_tree.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace linkwise {

void BlockTree::set_structure(std::span<const int> parents, std::span<const int> dims) {
  const int count = static_cast<int>(parents.size());
  parent.assign(parents.begin(), parents.end());
  dim.assign(dims.begin(), dims.end());
  offset.assign(count + 1, 0);
  for (int i = 0; i < count; ++i) offset[i + 1] = offset[i] + dim[i];
  diag.assign(count, Block{});
  parent_block.assign(count, Block{});
  hub.assign(count, -1);
  lever_of.assign(count, -1);
  hubs.clear();
  levers.clear();

  std::vector<int> children(count, 0);
  for (int i = 0; i < count; ++i)
    if (parent[i] >= 0) ++children[parent[i]];
  for (int i = 0; i < count; ++i) {
    if (children[i] < 2) continue;
    hub[i] = static_cast<int>(hubs.size());
    hubs.emplace_back().node = i;
    hubs.back().children.reserve(children[i]);
  }
  for (int i = 0; i < count; ++i) {
    if (parent[i] < 0 || hub[parent[i]] < 0) continue;
    lever_of[i] = static_cast<int>(levers.size());
    levers.emplace_back();
    hubs[hub[parent[i]]].children.push_back(i);
  }
}

void BlockTree::multiply(std::span<const double> x, std::span<double> y) const {
  const int count = n();
  const double* const from = x.data();
  double* const to = y.data();
  std::fill(y.begin(), y.end(), 0.0);
  for (int i = 0; i < count; ++i) {
    const double* xi = from + offset[i];
    double* yi = to + offset[i];
    const int p = lever_of[i] < 0 ? parent[i] : -1;
    if (p < 0) {
      block_multiply_add(dim[i], dim[i], diag[i], xi, yi);
      continue;
    }
    with_dims(dim[i], dim[p], [&](auto r, auto c) {
      block_multiply_add<r.n, r.n>(diag[i].data(), xi, yi, 1.0);
      block_multiply_add<r.n, c.n>(parent_block[i].data(), from + offset[p], yi, 1.0);
      block_transpose_multiply_add<r.n, c.n>(parent_block[i].data(), xi, to + offset[p], 1.0);
    });
  }
  for (const Hub& body : hubs) multiply_hub(body, x, y);
}

// With h_i = H_i^T x_i and s = sum h_i - K^T x_p: y_i += H_i C (s - h_i), y_p -= K C sum h_i.
// The joint's own term H_i C H_i^T x_i is part of the diagonal block already.
void BlockTree::multiply_hub(const Hub& body, std::span<const double> x,
                             std::span<double> y) const {
  const int p = body.node;
  double sum[6] = {}, inboard_part[6] = {}, accelerated[6] = {};
  for (int i : body.children)
    block_transpose_multiply_add(dim[i], 6, levers[lever_of[i]], x.data() + offset[i], sum);
  block_multiply_add<6, 6>(body.compliance.data(), sum, accelerated, 1.0);
  block_multiply_add(dim[p], 6, body.inboard, accelerated, y.data() + offset[p], -1.0);
  block_transpose_multiply_add(dim[p], 6, body.inboard, x.data() + offset[p], inboard_part);
  for (int k = 0; k < 6; ++k) sum[k] -= inboard_part[k];
  for (int i : body.children) {
    double others[6], response[6] = {};
    std::copy(sum, sum + 6, others);
    block_transpose_multiply_add(dim[i], 6, levers[lever_of[i]], x.data() + offset[i], others,
                                 -1.0);
    block_multiply_add<6, 6>(body.compliance.data(), others, response, 1.0);
    block_multiply_add(dim[i], 6, levers[lever_of[i]], response, y.data() + offset[i]);
  }
}

namespace {

bool is_finite(const Block& block, int rows, int cols) {
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < cols; ++j)
      if (!std::isfinite(block[6 * i + j])) return false;
  return true;
}

void require(bool condition, const char* what, int node) {
  if (!condition) throw std::logic_error("block tree, node " + std::to_string(node) + ": " + what);
}

void check_symmetric(const Block& block, int rows, const char* what, int node) {
  double scale = 0.0;
  for (int i = 0; i < rows; ++i) scale = std::max(scale, std::abs(block[7 * i]));
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < i; ++j)
      require(std::abs(block[6 * i + j] - block[6 * j + i]) <= 1e-12 * scale, what, node);
}

}  // namespace

bool BlockTree::all_finite() const {
  for (int i = 0; i < n(); ++i) {
    if (!is_finite(diag[i], dim[i], dim[i])) return false;
    if (lever_of[i] >= 0) {
      if (!is_finite(levers[lever_of[i]], dim[i], 6)) return false;
    } else if (parent[i] >= 0 && !is_finite(parent_block[i], dim[i], dim[parent[i]])) {
      return false;
    }
  }
  for (const Hub& body : hubs)
    if (!is_finite(body.compliance, 6, 6) || !is_finite(body.inboard, dim[body.node], 6))
      return false;
  return true;
}

void BlockTree::check_consistency() const {
  const int count = n();
  const auto nodes = parent.size();
  if (dim.size() != nodes || offset.size() != nodes + 1 || diag.size() != nodes ||
      parent_block.size() != nodes || hub.size() != nodes || lever_of.size() != nodes)
    throw std::logic_error("block tree: arrays of different lengths");
  if (offset[0] != 0) throw std::logic_error("block tree: the first offset is not zero");
  std::vector<int> children(nodes, 0);
  for (int i = 0; i < count; ++i) {
    require(parent[i] >= -1 && parent[i] < i, "parent does not come before it", i);
    require(dim[i] >= 0 && dim[i] <= 6, "dimension outside 0..6", i);
    require(offset[i + 1] == offset[i] + dim[i], "offset does not follow the dimensions", i);
    check_symmetric(diag[i], dim[i], "diagonal block is not symmetric", i);
    if (parent[i] >= 0) ++children[parent[i]];
  }
  for (int i = 0; i < count; ++i) {
    const bool is_hub = children[i] > 1;
    require(is_hub == (hub[i] >= 0), "hub index does not match the number of children", i);
    if (is_hub) {
      require(hub[i] < static_cast<int>(hubs.size()), "hub index out of range", i);
      const Hub& body = hubs[hub[i]];
      require(body.node == i, "hub belongs to another node", i);
      require(static_cast<int>(body.children.size()) == children[i], "hub misses a child", i);
      require(std::is_sorted(body.children.begin(), body.children.end()), "children unsorted", i);
      for (int child : body.children) require(parent[child] == i, "hub with a foreign child", i);
      check_symmetric(body.compliance, 6, "hub compliance is not symmetric", i);
    }
    const bool has_lever = parent[i] >= 0 && children[parent[i]] > 1;
    require(has_lever == (lever_of[i] >= 0), "lever does not match the parent", i);
    require(lever_of[i] < static_cast<int>(levers.size()), "lever index out of range", i);
  }
}

}  // namespace linkwise
