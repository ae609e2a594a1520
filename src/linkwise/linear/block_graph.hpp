#pragma once
// The symmetric positive semidefinite block system A x = b on any graph: a node per constraint, a
// hub per body. What a hub yields couples all nodes that end on it,
//     A = E + sum_k H_k C_k H_k^T,
// with C_k the hub's compliance, H_k the levers of its ends, and E a diagonal. A hub has one moving
// frame, or two if it is elastic: C_k is 6 x 6 or 12 x 12. A is never formed: a product takes
// O(ends), however many meet in one hub.
#include <span>
#include <type_traits>
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
  std::vector<double> levers;            ///< rows x width of the hub, end after end
  std::vector<int> motion_begin;         ///< of each hub, and the end: differences are widths
  std::vector<std::size_t> compliance_begin;
  std::vector<double> compliances;  ///< C of each hub, full and symmetric, width x width
  std::vector<double> own;          ///< E

  int n() const { return static_cast<int>(offset.size()) - 1; }
  int n_hubs() const { return static_cast<int>(hub_begin.size()) - 1; }
  int size() const { return offset.back(); }
  int dim(int node) const { return offset[node + 1] - offset[node]; }
  /// 6 or 12.
  int width(int hub) const { return motion_begin[hub + 1] - motion_begin[hub]; }
  double* compliance(int hub) { return compliances.data() + compliance_begin[hub]; }
  const double* compliance(int hub) const { return compliances.data() + compliance_begin[hub]; }
  /// Row r of the lever of a node at its hub number `which`, as many numbers as the hub is wide.
  double* lever(int node, int which, int r) {
    const int e = node_ends[node_begin[node] + which];
    return &levers[lever_begin[e] + static_cast<std::size_t>(width(end_hub[e])) * r];
  }

  /// Rows of each node, and the hubs that it ends on, none of them twice. Numbers are zero.
  /// is_wide: of each hub; those beyond are not.
  void set_structure(std::span<const int> dims, std::span<const std::vector<int>> hubs_of,
                     const std::vector<char>& is_wide = {});

  /// y = A x. motions: room of the caller's. x and y must not overlap.
  void multiply(std::span<const double> x, std::span<double> y, std::vector<double>& motions,
                const Executor& executor = Executor()) const;
  /// A_ii, lower triangle, packed.
  void calc_diagonal(int node, double* packed_lower) const;
  /// What the hub of one end adds to it.
  void add_to_diagonal(int end, double* packed_lower) const;
  bool all_finite() const;
};

/// f(width), a constant: loops of known length are unrolled.
template <class F>
void with_width(int width, F&& f) {
  if (width == 6)
    f(std::integral_constant<int, 6>());
  else
    f(std::integral_constant<int, 12>());
}

}  // namespace linkwise
