#pragma once
// Cutting a tree into connected pieces of about a given number of joints.

#include <vector>

#include "linkwise/linear/block_tree.hpp"

namespace linkwise {

/// cut[i] = 1 where node i starts a piece of its own: every `joints` nodes down from the base. The
/// joints of a hub stay together with its inboard joint, so that pieces around hubs grow larger and
/// a tree that branches everywhere stays whole.
inline void cut_into_pieces(const BlockTree& A, int joints, std::vector<char>& cut) {
  std::vector<int> depth(A.n(), 1);
  cut.assign(A.n(), 0);
  for (int i = 0; i < A.n(); ++i) {
    const int p = A.parent[i];
    if (p < 0) continue;
    depth[i] = depth[p] + 1;
    if (depth[i] <= joints || A.lever_of[i] >= 0) continue;
    depth[i] = 1;
    cut[i] = 1;
  }
}

}  // namespace linkwise
