#pragma once
// The symmetric positive semidefinite block system A x = b on any graph: a node per constraint, a
// hub per body. What a hub yields couples all nodes that end on it,
//     A = E + sum_k H_k C_k H_k^T,
// with C_k the hub's 6 x 6 compliance, H_k the levers of its ends, and E a diagonal. A is never
// formed: a product takes O(ends), however many meet in one hub.
#include <span>
#include <vector>

#include "linkwise/exec/executor.hpp"
#include "linkwise/linear/block.hpp"

namespace linkwise {

struct BlockGraph {
  std::vector<int> offset;     ///< n + 1 entries: where node i's rows start; 0 to 6 rows each
  std::vector<int> hub_begin;  ///< ends of hub k are [hub_begin[k], hub_begin[k + 1])
  std::vector<int> end_node, end_hub;    ///< of each end
  std::vector<int> node_begin;           ///< ends of node i: node_ends[node_begin[i] ...]
  std::vector<int> node_ends;            ///< in the order in which its hubs were given
  std::vector<std::size_t> lever_begin;  ///< of each end
  std::vector<double> levers;            ///< rows x 6, end after end
  std::vector<Block> compliance;         ///< C of each hub, full and symmetric
  std::vector<double> own;               ///< E

  int n() const { return static_cast<int>(offset.size()) - 1; }
  int n_hubs() const { return static_cast<int>(hub_begin.size()) - 1; }
  int size() const { return offset.back(); }
  int dim(int node) const { return offset[node + 1] - offset[node]; }
  /// Row r of the lever of a node at its hub number `which`, 6 numbers.
  double* lever(int node, int which, int r) {
    return &levers[lever_begin[node_ends[node_begin[node] + which]] + 6 * std::size_t(r)];
  }

  /// Rows of each node, and the hubs that it ends on, none of them twice. Numbers are zero.
  void set_structure(std::span<const int> dims, std::span<const std::vector<int>> hubs_of);

  /// y = A x. motions: room of the caller's. x and y must not overlap.
  void multiply(std::span<const double> x, std::span<double> y, std::vector<double>& motions,
                const Executor& executor = Executor()) const;
  /// A_ii, lower triangle, packed.
  void calc_diagonal(int node, double* packed_lower) const;
  bool all_finite() const;
};

}  // namespace linkwise
