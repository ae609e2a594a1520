#include "linkwise/linear/scaled_tree.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/linear/vector.hpp"

namespace linkwise {
namespace {

/// C = R R^T of a hub's compliance. A direction with no compliance (a body held by the ground)
/// gives a zero column; a negative one fails.
bool compliance_root(const Block& compliance, Block& root) {
  double scale = 0.0;
  for (int i = 0; i < 6; ++i) scale = std::max(scale, std::abs(compliance[7 * i]));
  return cholesky_root(6, compliance, -1e-12 * scale, 1e-15 * scale, root);
}

/// out = L^-1 B R, B dim x 6.
template <int dim>
void scale_lever(const double* lower, const double* roots, const Block& from, const Block& root,
                 Block& out) {
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < 6; ++j) {
      double sum = 0.0;
      for (int k = j; k < 6; ++k) sum += from[6 * i + k] * root[6 * k + j];
      out[6 * i + j] = sum;
    }
  ldlt_forward_block<dim, 6>(lower, out.data());
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < 6; ++j) out[6 * i + j] *= roots[i];
}

/// B <- L_i^-1 B L_p^-T.
template <int rows, int cols>
LW_INLINE void scale_coupling(const double* lower, const double* roots, const double* parent_lower,
                              const double* parent_roots, double* b) {
  ldlt_forward_block<rows, cols>(lower, b);
#pragma GCC unroll 6
  for (int i = 0; i < rows; ++i) {
    ldlt_forward<cols>(parent_lower, b + 6 * i);
#pragma GCC unroll 6
    for (int j = 0; j < cols; ++j) b[6 * i + j] *= roots[i] * parent_roots[j];
  }
}

}  // namespace

bool ScaledTree::same_structure(const BlockTree& A) const {
  return parent == A.parent && dim == A.dim && levers.size() == A.levers.size();
}

void ScaledTree::set_structure(const BlockTree& A) {
  const int count = A.n();
  parent = A.parent;
  dim = A.dim;
  offset = A.offset;
  hub = A.hub;
  lever_of = A.lever_of;
  only_child.assign(count, -1);
  for (int i = 0; i < count; ++i)
    if (parent[i] >= 0 && lever_of[i] < 0) only_child[parent[i]] = i;
  coupling.resize(count);
  levers.resize(A.levers.size());
  hubs.resize(A.hubs.size());
  joints_on_a_body_ = 2;
  for (std::size_t h = 0; h < hubs.size(); ++h) {
    hubs[h].node = A.hubs[h].node;
    hubs[h].children = A.hubs[h].children;
    joints_on_a_body_ = std::max(joints_on_a_body_, static_cast<int>(hubs[h].children.size()) + 1);
  }
  hub_sums_.resize(6 * hubs.size());
  lower_.resize(count);
  roots_.resize(count);
}

bool ScaledTree::prepare(const BlockTree& A) {
  structure_changed_ = !same_structure(A);
  if (structure_changed_) set_structure(A);
  const Tiles tiles(n(), TileOf::nodes);
  std::array<int, max_tiles> failed;
  tiles.for_each(executor_, [&](int t, int begin, int end) {
    failed[t] = -1;
    for (int i = begin; i < end; ++i)
      with_dim(dim[i], [&](auto d) {
        double* const lower = lower_[i].data();
        pack_lower<d.n>(A.diag[i].data(), lower);
        if (!ldlt_factor<d.n>(lower) && failed[t] < 0) failed[t] = i;
#pragma GCC unroll 6
        for (int k = 0; k < d.n; ++k) roots_[i][k] = std::sqrt(lower[packed(k, k)]);
      });
  });
  for (int t = 0; t < tiles.count; ++t) {
    failed_node_ = failed[t];
    if (failed_node_ >= 0) return false;
  }
  for_each_node([&](int i) {
    if (parent[i] >= 0 && lever_of[i] < 0) scale_node(A, i);
  });
  for (std::size_t h = 0; h < hubs.size(); ++h)
    if (!scale_hub(A, static_cast<int>(h))) return false;
  failed_node_ = -1;
  return true;
}

void ScaledTree::scale_node(const BlockTree& A, int i) {
  const int p = parent[i];
  coupling[i] = A.parent_block[i];
  with_dims(dim[i], dim[p], [&](auto d, auto c) {
    scale_coupling<d.n, c.n>(lower_[i].data(), roots_[i].data(), lower_[p].data(), roots_[p].data(),
                             coupling[i].data());
  });
}

bool ScaledTree::scale_hub(const BlockTree& A, int h) {
  Hub& body = hubs[h];
  Block root;
  failed_node_ = body.node;
  if (!compliance_root(A.hubs[h].compliance, root)) return false;
  const auto scale = [&](int i, const Block& from, Block& out) {
    with_dim(dim[i], [&](auto d) {
      scale_lever<d.n>(lower_[i].data(), roots_[i].data(), from, root, out);
    });
  };
  scale(body.node, A.hubs[h].inboard, body.inboard);
  for (int i : body.children) scale(i, A.levers[lever_of[i]], levers[lever_of[i]]);
  return true;
}

void ScaledTree::colour(std::vector<int>& colours) const {
  colours.resize(n());
  // Joints of one hub get consecutive colours, skipping the inboard joint's.
  std::vector<int> next(hubs.size(), 0);
  for (int i = 0; i < n(); ++i) {
    const int p = parent[i];
    if (p < 0) {
      colours[i] = 0;
    } else if (lever_of[i] < 0) {
      colours[i] = colours[p] == 0 ? 1 : 0;
    } else {
      int& own = next[hub[p]];
      if (own == colours[p]) ++own;
      colours[i] = own++;
    }
  }
}

void ScaledTree::scale_right_hand_side(std::span<const double> b, std::span<double> scaled) const {
  for_each_node([&](int i) {
    with_dim(dim[i], [&](auto d) {
      double local[6] = {};
      std::copy(b.data() + offset[i], b.data() + offset[i] + d.n, local);
      ldlt_forward<d.n>(lower_[i].data(), local);
      for (int k = 0; k < d.n; ++k) scaled[offset[i] + k] = local[k] * roots_[i][k];
    });
  });
}

void ScaledTree::scale_solution(std::span<const double> x, std::span<double> scaled) const {
  for_each_node([&](int i) {
    with_dim(dim[i], [&](auto d) {
      const double* xi = x.data() + offset[i];
      for (int k = 0; k < d.n; ++k) {
        double sum = xi[k];
        for (int r = k + 1; r < d.n; ++r) sum += lower_[i][packed(r, k)] * xi[r];
        scaled[offset[i] + k] = sum / roots_[i][k];
      }
    });
  });
}

void ScaledTree::unscale_solution(std::span<const double> scaled, std::span<double> x) const {
  for_each_node([&](int i) {
    with_dim(dim[i], [&](auto d) {
      double local[6];
      for (int k = 0; k < d.n; ++k) local[k] = scaled[offset[i] + k] * roots_[i][k];
      ldlt_backward<d.n>(lower_[i].data(), local);
      std::copy(local, local + d.n, x.data() + offset[i]);
    });
  });
}

double ScaledTree::solution_norm(std::span<const double> scaled) const {
  return std::sqrt(sum_over_nodes([&](int i) {
    double total = 0.0;
    with_dim(dim[i], [&](auto d) {
      double local[6];
      for (int k = 0; k < d.n; ++k) local[k] = scaled[offset[i] + k] * roots_[i][k];
      ldlt_backward<d.n>(lower_[i].data(), local);
      for (int k = 0; k < d.n; ++k) total += local[k] * local[k];
    });
    return total;
  }));
}

double ScaledTree::residual_norm(std::span<const double> scaled) const {
  return std::sqrt(sum_over_nodes([&](int i) {
    double total = 0.0;
    with_dim(dim[i], [&](auto d) {
      double local[6];
      for (int k = 0; k < d.n; ++k) local[k] = scaled[offset[i] + k] / roots_[i][k];
      for (int k = 0; k < d.n; ++k) {
        double sum = local[k];
        for (int j = 0; j < k; ++j) sum += lower_[i][packed(k, j)] * local[j];
        total += sum * sum;
      }
    });
    return total;
  }));
}

}  // namespace linkwise
