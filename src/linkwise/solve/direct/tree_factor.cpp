// Block elimination of an SPD block tree, leaf to root.
//
// Node i with pivot S_i couples inboard to p = parent(i) alone once its subtree is eliminated:
//     S_p <- S_p - A_ip^T S_i^-1 A_ip                                       (chain,
//     [golub2013] 4.5)
// The children of a hub couple with each other too. As every coupling passes the body's compliance
// C, eliminating child i only changes C, for the later siblings and the inboard joint alike:
//     C <- C - C H_i^T S_i^-1 H_i C,   S_s = D_s + H_s (C - C_0) H_s^T,   S_p = D_p + K (C - C_0)
//     K^T
// so a body with k outboard joints costs O(k) and no clique is formed.

#include "linkwise/solve/direct/tree_factor.hpp"

#include <algorithm>

namespace linkwise {
namespace {

/// S += B change B^T, packed, B rows x 6.
template <int rows>
LW_INLINE void add_congruence(const double* b, const double* change, double* s) {
  double product[36];
#pragma GCC unroll 6
  for (int i = 0; i < rows; ++i)
#pragma GCC unroll 6
    for (int j = 0; j < 6; ++j) {
      double sum = 0.0;
#pragma GCC unroll 6
      for (int k = 0; k < 6; ++k) sum += b[6 * i + k] * change[6 * k + j];
      product[6 * i + j] = sum;
    }
#pragma GCC unroll 6
  for (int i = 0; i < rows; ++i)
#pragma GCC unroll 6
    for (int j = 0; j <= i; ++j) {
      double sum = 0.0;
#pragma GCC unroll 6
      for (int k = 0; k < 6; ++k) sum += product[6 * i + k] * b[6 * j + k];
      s[packed(i, j)] += sum;
    }
}

}  // namespace

void TreeFactor::set_structure(const BlockTree& A, std::span<const char> cut) {
  const int n = A.n();
  parent_.assign(A.parent.begin(), A.parent.end());
  tree_parent_.assign(A.parent.begin(), A.parent.end());
  dim_.assign(A.dim.begin(), A.dim.end());
  offset_.assign(A.offset.begin(), A.offset.end());
  hub_.assign(A.hub.begin(), A.hub.end());
  lever_.assign(A.lever_of.begin(), A.lever_of.end());
  if (!cut.empty())
    for (int i = 0; i < n; ++i)
      if (cut[i]) parent_[i] = lever_[i] = -1;
  loaded_.assign(n, 0);
  nodes_.resize(n);
  hubs_.resize(A.hubs.size());
  levers_.assign(A.levers.begin(), A.levers.end());
  for (std::size_t h = 0; h < hubs_.size(); ++h) {
    hubs_[h].change.fill(0.0);
    hubs_[h].inboard = A.hubs[h].inboard;
  }
}

Outcome TreeFactor::factor(const BlockTree& A, std::span<const char> cut) {
  set_structure(A, cut);
  failed_node_ = -1;
  for (int i = A.n() - 1; i >= 0; --i) {
    const bool good = lever_[i] >= 0 ? eliminate_hub_child(A, i) : eliminate(A, i);
    if (good) continue;
    failed_node_ = i;
    clear();
    return A.all_finite() ? Outcome::not_positive_definite : Outcome::not_finite;
  }
  return Outcome::converged;
}

/// Applies to node i's pivot block what the elimination of its subtree and of later siblings has
/// changed.
void TreeFactor::complete_pivot(const BlockTree& A, int i) {
  with_dim(dim_[i], [&](auto d) {
    double* const lower = nodes_[i].lower.data();
    if (!loaded_[i]) pack_lower<d.n>(A.diag[i].data(), lower);
    if (hub_[i] >= 0) {
      const HubState& body = hubs_[hub_[i]];
      add_congruence<d.n>(body.inboard.data(), body.change.data(), lower);
    }
    if (lever_[i] >= 0)
      add_congruence<d.n>(levers_[lever_[i]].data(), hubs_[hub_[parent_[i]]].change.data(), lower);
  });
}

bool TreeFactor::eliminate(const BlockTree& A, int i) {
  const int p = parent_[i];
  double* const lower = nodes_[i].lower.data();
  if (!loaded_[i] || hub_[i] >= 0) complete_pivot(A, i);
  if (p < 0) return with_dim(dim_[i], [&](auto d) { return ldlt_factor<d.n>(lower); });
  loaded_[p] = 1;
  return with_dims(dim_[i], dim_[p], [&](auto d, auto c) {
    Node& node = nodes_[i];
    double pivot[21], inboard[36], parent_pivot[21];
    std::copy(lower, lower + packed(d.n, 0), pivot);
    const bool good = ldlt_factor<d.n>(pivot);
#pragma GCC unroll 6
    for (int r = 0; r < d.n; ++r)
#pragma GCC unroll 6
      for (int k = 0; k < c.n; ++k) inboard[6 * r + k] = A.parent_block[i][6 * r + k];
    ldlt_forward_block<d.n, c.n>(pivot, inboard);
    pack_lower<c.n>(A.diag[p].data(), parent_pivot);
    ldlt_downdate<d.n, c.n>(pivot, inboard, parent_pivot);
    std::copy(parent_pivot, parent_pivot + packed(c.n, 0), nodes_[p].lower.data());
    std::copy(pivot, pivot + packed(d.n, 0), lower);
#pragma GCC unroll 6
    for (int r = 0; r < d.n; ++r)
#pragma GCC unroll 6
      for (int k = 0; k < c.n; ++k) node.inboard[6 * r + k] = inboard[6 * r + k];
    return good;
  });
}

bool TreeFactor::eliminate_hub_child(const BlockTree& A, int i) {
  const int h = hub_[parent_[i]];
  HubState& body = hubs_[h];
  const Block& lever = levers_[lever_[i]];
  Node& node = nodes_[i];
  double* const lower = node.lower.data();
  Block compliance = A.hubs[h].compliance;
  for (int k = 0; k < 36; ++k) compliance[k] += body.change[k];
  complete_pivot(A, i);
  return with_dim(dim_[i], [&](auto d) {
    if (!ldlt_factor<d.n>(lower)) return false;
    for (int r = 0; r < d.n; ++r)
      for (int k = 0; k < 6; ++k) {
        double sum = 0.0;
        for (int l = 0; l < 6; ++l) sum += lever[6 * r + l] * compliance[6 * l + k];
        node.inboard[6 * r + k] = sum;
      }
    ldlt_forward_block<d.n, 6>(lower, node.inboard.data());
    double change[21];
    pack_lower<6>(body.change.data(), change);
    ldlt_downdate<d.n, 6>(lower, node.inboard.data(), change);
    for (int r = 0; r < 6; ++r)
      for (int k = 0; k <= r; ++k)
        body.change[6 * r + k] = body.change[6 * k + r] = change[packed(r, k)];
    return true;
  });
}

// r_s = b_s + H_s g and r_p = b_p - K g, where g = - sum C H_i^T S_i^-1 r_i over the eliminated
// children, is how siblings and the inboard joint feel a hub's children.
void TreeFactor::sweep_tip_to_base(double* x) {
  for (HubState& body : hubs_) std::fill(body.response, body.response + 6, 0.0);
  for (int i = static_cast<int>(dim_.size()) - 1; i >= 0; --i) {
    double* const xi = x + offset_[i];
    const Node& node = nodes_[i];
    const int p = parent_[i];
    if (hub_[i] >= 0)
      block_multiply_add(dim_[i], 6, hubs_[hub_[i]].inboard, hubs_[hub_[i]].response, xi, -1.0);
    const bool hub_child = lever_[i] >= 0;
    double* const target = p < 0 ? nullptr : hub_child ? hubs_[hub_[p]].response : x + offset_[p];
    if (hub_child) block_multiply_add(dim_[i], 6, levers_[lever_[i]], target, xi);
    const int cols = p < 0 ? 0 : hub_child ? 6 : dim_[p];
    with_dims(dim_[i], cols, [&](auto d, auto c) {
      double local[6];
      std::copy(xi, xi + d.n, local);
      ldlt_forward<d.n>(node.lower.data(), local);
      ldlt_scale<d.n>(node.lower.data(), local);
      std::copy(local, local + d.n, xi);
      block_transpose_multiply_add<d.n, c.n>(node.inboard.data(), local, target, -1.0);
    });
  }
}

void TreeFactor::sweep_base_to_tip(double* x) {
  const int n = static_cast<int>(dim_.size());
  for (int i = 0; i < n; ++i) {
    double* const xi = x + offset_[i];
    const Node& node = nodes_[i];
    const int p = parent_[i];
    const bool hub_child = lever_[i] >= 0;
    double* const source = p < 0 ? nullptr : hub_child ? hubs_[hub_[p]].carried : x + offset_[p];
    const int cols = p < 0 ? 0 : hub_child ? 6 : dim_[p];
    with_dims(dim_[i], cols, [&](auto d, auto c) {
      double inboard[6] = {}, local[6];
      block_multiply_add<d.n, c.n>(node.inboard.data(), source, inboard, 1.0);
      std::copy(xi, xi + d.n, local);
#pragma GCC unroll 6
      for (int k = 0; k < d.n; ++k) local[k] -= node.lower[packed(k, k)] * inboard[k];
      ldlt_backward<d.n>(node.lower.data(), local);
      std::copy(local, local + d.n, xi);
    });
    if (hub_child) block_transpose_multiply_add(dim_[i], 6, levers_[lever_[i]], xi, source);
    if (hub_[i] < 0) continue;
    HubState& body = hubs_[hub_[i]];
    std::fill(body.carried, body.carried + 6, 0.0);
    block_transpose_multiply_add(dim_[i], 6, body.inboard, xi, body.carried, -1.0);
  }
}

void TreeFactor::solve_in_place(std::span<double> x) {
  sweep_tip_to_base(x.data());
  sweep_base_to_tip(x.data());
}

}  // namespace linkwise
