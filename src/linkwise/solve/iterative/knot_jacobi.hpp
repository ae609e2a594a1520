#pragma once
// What conjugate gradients on a graph are preconditioned by. The block diagonal D_A, of
// [sharf1993], bounds them on elastic bodies: with A_b what body b puts into A, D_b its block
// diagonal and c D_b <= A_b <= C D_b, the spectrum of D_A^-1 A lies in [c, C] for any graph and
// number of bodies [wathen1987]. A rigid body has c = 0. Where its joints end on elastic bodies
// all around, it is a knot and is taken as a whole,
//     P = sum_elastic D_b + sum_knots A_b,
// with the same bound. P is solved knot by knot: with D of the elastic ends, H and C of the knot,
//     P^-1 = D^-1 - D^-1 H (C^-1 + H^T D^-1 H)^-1 H^T D^-1     [hager1989],
// or by a dense factor where a joint with the ground leaves D singular.
#include <span>
#include <vector>

#include "linkwise/linear/block_graph.hpp"

namespace linkwise {

class KnotJacobi {
 public:
  /// Returns the node whose block is not positive definite, or -1.
  int factor(const BlockGraph& A);
  /// z = P^-1 r. r and z must not overlap.
  void solve(const BlockGraph& A, std::span<const double> r, std::span<double> z,
             const Executor& executor) const;

  /// Between which numbers the spectrum of P^-1 A lies. Smallest 0: a body that is no knot puts
  /// nothing into some row alone, and there is no bound.
  struct Bound {
    double smallest = 1, largest = 1;
    /// Iterations that bring the error in the energy norm down to `tolerance` of the first one.
    double iterations(double tolerance) const;
  };
  Bound bound(const BlockGraph& A) const;

 private:
  void find_knots(const BlockGraph& A);
  bool factor_knot(const BlockGraph& A, int at);
  void solve_knot(const BlockGraph& A, int at, std::span<double> z) const;
  /// A knot with joints on the ground.
  struct Held {
    int hub, rows;
    std::vector<double> L;  ///< factor of its part of P
  };
  bool factor_held(const BlockGraph& A, Held& knot);
  void solve_held(const BlockGraph& A, const Held& knot, std::span<double> z) const;
  void calc_elastic_part(const BlockGraph& A, int node, double* block) const;

  enum InKnot : char { in_none, in_free, in_held };
  std::vector<int> knots_;  ///< hubs, of knots that only elastic bodies hold
  std::vector<Held> held_;
  std::vector<InKnot> is_in_knot_;  ///< by node
  std::vector<double> block_;       ///< factor of each node's block, 21 numbers
  std::vector<double> inner_;       ///< factor of C^-1 + H^T D^-1 H of each knot, 21 numbers
};

}  // namespace linkwise
