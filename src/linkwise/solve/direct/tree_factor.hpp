#pragma once
// A = L D L^T of a block tree, leaf to root, shared by the solvers that need an exact or partial
// elimination (thomas, lagged_thomas, block Schwarz, two_level).

#include <span>
#include <vector>

#include "linkwise/linear/block_tree.hpp"
#include "linkwise/linear/ldlt.hpp"
#include "linkwise/solve/solver.hpp"

namespace linkwise {

class TreeFactor {
 public:
  /// Factors A. Nodes with cut[i] != 0 are treated as uncoupled inboard, which splits the tree into
  /// pieces; an empty span cuts nothing. The factor keeps all it needs: A may change or vanish.
  Outcome factor(const BlockTree& A, std::span<const char> cut = {});

  /// x <- A^-1 x.
  void solve_in_place(std::span<double> x);

  /// The node at which factor() failed, or -1.
  int failed_node() const { return failed_node_; }
  bool empty() const { return dim_.empty(); }
  /// Was the last factor made for a tree of this structure, whatever its numbers?
  bool fits(const BlockTree& A) const { return dim_ == A.dim && tree_parent_ == A.parent; }
  /// Forgets the factor, keeps the memory.
  void clear() { dim_.clear(); }

 private:
  struct Node {
    PackedLower lower;  ///< the pivot block, factored in place: L and 1 / D
    Block inboard;      ///< L^-1 A_ip, or L^-1 H_i C for the child of a hub
  };
  struct HubState {
    Block change;        ///< C - C_0 after the outboard joints eliminated so far
    Block inboard;       ///< K
    double response[6];  ///< C sum H^T S^-1 r
    double carried[6];   ///< sum H^T x - K^T x_p
  };

  void set_structure(const BlockTree& A, std::span<const char> cut);
  bool eliminate(const BlockTree& A, int i);
  bool eliminate_hub_child(const BlockTree& A, int i);
  void complete_pivot(const BlockTree& A, int i);
  void sweep_tip_to_base(double* x);
  void sweep_base_to_tip(double* x);

  std::vector<int> tree_parent_;  ///< as given, without cuts
  std::vector<int> parent_, dim_, offset_, hub_, lever_;
  std::vector<char> loaded_;  ///< does the pivot block hold its node's diagonal already?
  std::vector<Node> nodes_;
  std::vector<HubState> hubs_;
  std::vector<Block> levers_;
  int failed_node_ = -1;
};

}  // namespace linkwise
