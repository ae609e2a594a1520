#pragma once
// The symmetric positive definite block system A x = b on a forest: one node per joint, one block
// of 0 to 6 rows per node. Node i couples to its parent and, through the body between them, to its
// siblings (A f = b of [sharf1993], eqs. (10)-(13), for trees).
//
// A body with several outboard joints is a hub. Its joints all couple with each other. Forming that
// dense clique would cost the square of their number, factoring it the cube. A hub keeps the
// factors instead: with C the body's 6 x 6 compliance at its inboard joint, K the inboard joint's
// constrained directions and H_i the lever of outboard joint i,
//     A_is = H_i C H_s^T    (siblings i, s),
//     A_ip = -H_i C K^T     (joint i with inboard joint p),
// so that every operation costs O(outboard joints) (compare [baraff1996], which keeps the body's
// acceleration as an unknown). A chain has no hubs and uses parent_block alone.

#include <array>
#include <span>
#include <vector>

#include "linkwise/linear/block.hpp"

namespace linkwise {

struct BlockTree {
  struct Hub {
    int node = -1;              ///< the inboard joint of the hub body
    Block compliance{};         ///< C, 6 x 6, symmetric
    Block inboard{};            ///< K, dim[node] x 6
    std::vector<int> children;  ///< the outboard joints, ascending
  };

  std::vector<int> parent;  ///< parent[i] < i, or -1 on the ground
  std::vector<int> dim;     ///< rows of node i, 0 to 6
  std::vector<int> offset;  ///< n + 1 entries: where node i's block starts in a vector
  std::vector<Block> diag;  ///< A_ii, full and symmetric, dim x dim
  /// A_{i,parent(i)}, dim[i] x dim[parent]. Unused for a child of the ground or of a hub.
  std::vector<Block> parent_block;
  std::vector<int> hub;  ///< per node: index of the hub whose inboard joint it is, or -1
  std::vector<Hub> hubs;
  std::vector<int> lever_of;  ///< per node: index into levers when its parent is a hub, or -1
  std::vector<Block> levers;  ///< H_i, dim[i] x 6

  /// Number of nodes.
  int n() const { return static_cast<int>(parent.size()); }
  /// Number of scalar unknowns.
  int size() const { return offset.empty() ? 0 : offset.back(); }

  /// Lays the structure out: offsets, hubs and levers from parents and dimensions; blocks are zero.
  void set_structure(std::span<const int> parents, std::span<const int> dims);

  /// y = A x in O(n). x and y must not overlap.
  void multiply(std::span<const double> x, std::span<double> y) const;

  /// Are all blocks in use finite?
  bool all_finite() const;

  /// Throws std::logic_error, naming the node, when the arrays do not fit together or a diagonal
  /// block is not symmetric. For tests: solvers take a consistent tree for granted.
  void check_consistency() const;

 private:
  void multiply_hub(const Hub& body, std::span<const double> x, std::span<double> y) const;
};

}  // namespace linkwise
