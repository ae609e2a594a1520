#pragma once
// The nodes of a forest of chains, chain by chain from base to tip, for solvers that need chains.

#include <string>
#include <string_view>
#include <vector>

#include "linkwise/base/error.hpp"
#include "linkwise/linear/block_tree.hpp"

namespace linkwise {

class ChainOrder {
 public:
  /// InputError, naming the solver and the hub's node, when the tree branches.
  void set(const BlockTree& A, std::string_view solver) {
    if (!A.hubs.empty())
      throw InputError(
          "solver '" + std::string(solver) + "' takes chains only, and the body of node " +
          std::to_string(A.hubs[0].node) + " has several outboard joints; use 'thomas'");
    if (parent_ == A.parent) return;
    parent_ = A.parent;
    nodes_.clear();
    starts_.clear();
    child_.assign(A.n(), -1);
    for (int i = 0; i < A.n(); ++i)
      if (parent_[i] >= 0) child_[parent_[i]] = i;
    for (int i = 0; i < A.n(); ++i) {
      if (parent_[i] >= 0) continue;
      starts_.push_back(static_cast<int>(nodes_.size()));
      for (int k = i; k >= 0; k = child_[k]) nodes_.push_back(k);
    }
    starts_.push_back(static_cast<int>(nodes_.size()));
  }

  int chains() const { return static_cast<int>(starts_.size()) - 1; }
  int length(int chain) const { return starts_[chain + 1] - starts_[chain]; }
  const int* nodes(int chain) const { return nodes_.data() + starts_[chain]; }

 private:
  std::vector<int> parent_, child_, nodes_, starts_{0};
};

}  // namespace linkwise
