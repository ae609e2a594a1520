#pragma once
// L D L^T of the system of a graph, front after front [duff1983]: a front is one dense matrix, made
// of what its hubs couple and of what its children leave, of which the pivots' columns are
// eliminated. In coordinates in which the block diagonal D_A of A is 1, a pivot says how far a row
// is from those before it. Rows that depend on them are left out: constraints that repeat each
// other make A singular, and of all x that solve it this one has zeros there.
#include <span>
#include <vector>

#include "linkwise/linear/block_graph.hpp"
#include "linkwise/linear/elimination_order.hpp"

namespace linkwise {

class GraphFactor {
 public:
  /// The structure of later systems. OutOfMemory where the factor does not fit.
  explicit GraphFactor(const BlockGraph& structure);

  /// Pivots below `null` count as zero. least: the least x will be asked of solve(). Returns the
  /// node at which the factorisation broke down, or -1.
  int factor(const BlockGraph& A, double null, bool least);

  /// x solves A x = b but for what b demands of rows that are left out beyond the others; refined
  /// once. least: of all solutions the one of least x^T D_A x. x may be b. Returns the largest
  /// component of b - A x where D_A is 1.
  double solve(const BlockGraph& A, std::span<const double> b, std::span<double> x, bool least);

  int n_null() const { return n_null_; }
  /// The least pivot that is not zero; 1 if there is none.
  double smallest_pivot() const { return smallest_; }
  /// What a number of row i is where D_A is 1, or a bound of it.
  double scale(int node, int row) const;

 private:
  struct Step {
    int begin, pivots, rows;  ///< first row in elimination order; of the front's matrix
    std::size_t rest;         ///< in rest_: rows beyond the pivots, rows - pivots of them
    std::size_t panel;        ///< in L: rows x pivots, column-major
    std::size_t map;          ///< in map_: where the parent has each row of `rest`
    int first_hub, last_hub, first_child, last_child;
  };

  void lay_out(const BlockGraph& structure, const std::vector<Front>& fronts);
  bool scale_nodes(const BlockGraph& A);
  void add_own(const BlockGraph& A, int node, int p, int n, double more);
  void factor_fronts(const BlockGraph& A, double null, double shift, std::vector<double>& L,
                     std::vector<double>& inverse);
  void add_hub(const BlockGraph& A, int hub, const Step& step);
  template <int w>
  void add_hub(const BlockGraph& A, int hub, const Step& step, std::integral_constant<int, w>);
  void solve_once(const std::vector<double>& L, const std::vector<double>& inverse, double* x);
  void to_scaled(const double* b, double* x) const;
  void from_scaled(const double* x, double* out) const;
  double miss(const BlockGraph& A, const std::vector<double>& x);
  void add_answer(const std::vector<double>& L, const std::vector<double>& inverse,
                  std::vector<double>& x);

  std::vector<Step> steps_;
  std::vector<int> rest_, map_, hubs_, children_;
  std::vector<int> order_;       ///< of the nodes
  std::vector<int> place_;       ///< of each node: its first row in elimination order
  std::vector<int> offset_;      ///< of each node, as given
  std::vector<double> scaling_;  ///< factor of D_A, 21 numbers per node
  std::vector<double> L_, inverse_, shifted_L_, shifted_inverse_;
  std::vector<double> front_, stack_, levers_, motions_;
  std::vector<int> local_;
  std::size_t panels_ = 0, deepest_ = 0;
  int largest_ = 0, n_null_ = 0, failed_ = -1;
  double smallest_ = 1;
  std::vector<double> x_, left_, more_, given_, last_, product_;
};

/// Multiplications of a factorisation in that order.
double work_of(const BlockGraph& graph, const std::vector<Front>& fronts);

}  // namespace linkwise
