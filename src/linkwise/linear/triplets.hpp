#pragma once
// A block tree as the entries of a sparse matrix, for those who look at it with other tools.
#include <vector>

#include "linkwise/linear/block_tree.hpp"

namespace linkwise {

/// Entries (row, column, value); each place once, both triangles. Those of a block that happen to
/// be zero are listed as well.
struct Triplets {
  std::vector<int> row, column;
  std::vector<double> value;
};

/// A hub contributes the blocks of its clique, which solvers never form: O(outboard joints
/// squared).
Triplets triplets_of(const BlockTree& A);

}  // namespace linkwise
