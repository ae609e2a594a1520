#pragma once
// A tree cut at its branches, the natural pieces of a tree: subtrees small enough to be one
// worker's share, and the trunk that carries them. Tip to base the branches come first, base to tip
// the trunk, and the branches of either sweep need nothing of each other [hwang1988]. Cut by the
// model alone, never by the threads.
#include <vector>

#include "linkwise/model/model.hpp"

namespace linkwise {

struct Branches {
  struct Share {
    std::vector<KindRange> kind_ranges;
    std::vector<int> roots;  ///< of its subtrees, ascending; their parents are in the trunk
  };
  std::vector<KindRange> trunk;
  std::vector<Share> shares;

  /// Empty, no shares, where cutting would not halve what has to be done one after the other.
  explicit Branches(const Model& model);
  bool any() const { return !shares.empty(); }
};

}  // namespace linkwise
