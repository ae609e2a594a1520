#pragma once
// A block tree scaled by its diagonal: with D_i = L_i L_i^T,
//     A~ = L^-1 A L^-T = 1 + O,    b~ = L^-1 b,    x~ = L^T x.
// Every method that the paper writes with D^-1 is the same method on A~ without it: no block solve
// in the iteration, and a product takes 50 multiplications per node of 5 x 5. The norm of a
// residual that the preconditioner D induces is the plain Euclidean one. Hubs are scaled by a
// factor of their compliance as well, C = R R^T, so that A~_is = H~_i H~_s^T and A~_ip = -H~_i
// K~^T.

#include <span>
#include <vector>

#include "linkwise/exec/tiles.hpp"
#include "linkwise/linear/block_tree.hpp"
#include "linkwise/linear/ldlt.hpp"

namespace linkwise {

class ScaledTree {
 public:
  struct Hub {
    int node;
    Block inboard;              ///< K~
    std::vector<int> children;  ///< ascending
  };

  /// Who shares the work from now on; it influences no result.
  void set_executor(const Executor& executor) { executor_ = executor; }
  /// Scales A. False when a diagonal block or a hub's compliance is not positive definite;
  /// failed_node() tells where.
  bool prepare(const BlockTree& A);
  int failed_node() const { return failed_node_; }
  /// Did the last prepare() meet another structure than the one before?
  bool structure_changed() const { return structure_changed_; }

  int n() const { return static_cast<int>(parent.size()); }
  int size() const { return offset.empty() ? 0 : offset.back(); }

  /// The largest number of joints on one body, at least 2: a bound on the eigenvalues of A~, by the
  /// element bound of [wathen1987] (A and D are both sums over the bodies).
  int joints_on_a_body() const { return joints_on_a_body_; }

  /// Colours such that no two coupled nodes share one: red (0) and black (1) along chains; the
  /// joints of a hub are all coupled, so a hub with k outboard joints needs k + 1.
  void colour(std::vector<int>& colours) const;

  void scale_right_hand_side(std::span<const double> b, std::span<double> scaled) const;
  void scale_solution(std::span<const double> x, std::span<double> scaled) const;
  void unscale_solution(std::span<const double> scaled, std::span<double> x) const;
  /// ||L^-T v||, the Euclidean norm of a scaled solution's original.
  double solution_norm(std::span<const double> scaled) const;
  /// ||L v||, the Euclidean norm of a scaled residual's original.
  double residual_norm(std::span<const double> scaled) const;

  /// y = A~ x; x and y must not overlap.
  void multiply(std::span<const double> x, std::span<double> y) const;
  /// y += O x in the rows of the nodes with selected[i] == value only.
  void add_coupling(std::span<const double> x, std::span<double> y, std::span<const char> selected,
                    char value) const;

  /// Row-wise access for Gauss-Seidel: sums[6 h ...] = sum H~^T x - K~^T x_p over hub h.
  void hub_sums(std::span<const double> x, std::span<double> sums) const;
  /// row += sign O_i x, given up-to-date hub sums.
  void add_row(int i, const double* x, const double* sums, double* row, double sign) const;
  /// Keeps the hub sums up to date when x_i changes by `change`.
  void update_sums(int i, const double* change, double* sums) const;

  std::vector<int> parent, dim, offset;
  std::vector<int> only_child;  ///< the one child that couples by a block, or -1
  std::vector<int> hub, lever_of;
  std::vector<Block> coupling;  ///< A~_ip, of nodes that couple by a block
  std::vector<Hub> hubs;
  std::vector<Block> levers;  ///< H~_i

 private:
  bool same_structure(const BlockTree& A) const;
  void set_structure(const BlockTree& A);
  bool scale_hub(const BlockTree& A, int h);
  /// y += O x in the rows that selected(i) says.
  template <class Selected>
  void add_rows(std::span<const double> x, std::span<double> y, Selected&& selected) const;
  void scale_node(const BlockTree& A, int i);
  template <class F>
  void for_each_node(F&& f) const {
    Tiles(n(), TileOf::nodes).for_each(executor_, [&](int, int begin, int end) {
      for (int i = begin; i < end; ++i) f(i);
    });
  }
  template <class F>
  double sum_over_nodes(F&& f) const {
    return Tiles(n(), TileOf::nodes).sum(executor_, [&](int begin, int end) {
      double total = 0.0;
      for (int i = begin; i < end; ++i) total += f(i);
      return total;
    });
  }

  std::vector<PackedLower> lower_;            ///< unit L; the diagonal holds 1 / D
  std::vector<std::array<double, 6>> roots_;  ///< sqrt(1 / D)
  mutable std::vector<double> hub_sums_;
  int failed_node_ = -1, joints_on_a_body_ = 2;
  Executor executor_;
  bool structure_changed_ = false;
};

}  // namespace linkwise
