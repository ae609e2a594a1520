#include "linkwise/recursion/branches.hpp"

#include <algorithm>

namespace linkwise {
namespace {

/// Some ten microseconds of a recursion: well above the cost of handing it to a thread.
constexpr int fewest_in_a_share = 128;
constexpr int most_shares = 64;

}  // namespace

Branches::Branches(const Model& model) {
  const int n_bodies = model.n_bodies();
  const int limit = std::max(fewest_in_a_share, n_bodies / most_shares);
  if (n_bodies < 2 * limit) return;
  std::vector<int> size(n_bodies, 1);
  for (int n = n_bodies - 1; n >= 0; --n)
    if (const int parent = model.topology[n].parent; parent >= 0) size[parent] += size[n];
  int in_trunk = 0;
  for (int n = 0; n < n_bodies; ++n) in_trunk += size[n] > limit;
  if (2 * in_trunk > n_bodies) return;
  // Small subtrees are put together until they fill a share.
  std::vector<int> share_of(n_bodies, -1);
  int filled = limit;
  for (int n = 0; n < n_bodies; ++n) {
    const BodyTopology& body = model.topology[n];
    if (size[n] > limit) {
      append_to_ranges(trunk, body, n);
      continue;
    }
    const int inboard = body.parent >= 0 ? share_of[body.parent] : -1;
    if (inboard >= 0) {
      share_of[n] = inboard;
    } else {
      if (filled + size[n] > limit) {
        shares.emplace_back();
        filled = 0;
      }
      filled += size[n];
      share_of[n] = static_cast<int>(shares.size()) - 1;
      shares.back().roots.push_back(n);
    }
    append_to_ranges(shares[share_of[n]].kind_ranges, body, n);
  }
}

}  // namespace linkwise
