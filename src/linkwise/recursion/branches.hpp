#pragma once
// A tree split at its branches, the natural pieces of a tree: subtrees small enough to be one
// worker's share, and the trunk that carries them. In an inward sweep the branches come first, in
// an outward sweep the trunk does. Branches need nothing of each other [hwang1988]. Where the
// branches begin depends on the model alone, never on the number of threads.
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

  /// Has no shares if cutting would not halve the work that has to be done one after the other.
  explicit Branches(const Model& model);
  bool any() const { return !shares.empty(); }
};

}  // namespace linkwise
