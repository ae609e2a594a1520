#pragma once
// A symmetric positive semidefinite matrix of dense blocks of any size along a forest, and its
// block L D L^T, leaf to root. For small systems made of larger ones, as the coarse matrix of
// pieces.

#include <span>
#include <vector>

namespace linkwise {

struct DenseTree {
  struct Node {
    int parent = -1;              ///< comes before the node, or -1
    std::vector<int> unknowns;    ///< where they are in a vector
    std::vector<double> pivot;    ///< square; factored: L below the diagonal, 1 / D on it
    std::vector<double> inboard;  ///< coupling to the parent's unknowns; factored: L^-1 times it
  };
  std::vector<Node> nodes;

  /// Factors in place. A row whose pivot is at most `dependent` is spanned by rows eliminated
  /// before: it is left out, its unknown is zero and its 1 / D too. Returns the first such row, as
  /// an index of an unknown, or -1.
  int factor(double dependent);
  /// x <- A^-1 x by the factor; returns the product of both, the square of the A-norm of x.
  double solve_in_place(std::span<double> x) const;
};

}  // namespace linkwise
