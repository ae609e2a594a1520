#pragma once
// Solves a BorderedSystem by the Schur complement on its border, the forest by any solver:
//     Z = F^-1 C^T,   S = E - C Z,   y = S^-1 (c - C F^-1 b),   x = F^-1 b - Z y.
// One solve of the forest per border row besides that for b; a direct solver factors once.

#include <memory>
#include <span>
#include <vector>

#include "linkwise/linear/dense_tree.hpp"
#include "linkwise/solve/solver.hpp"
#include "solve/bordered_system.hpp"

namespace linkwise {

class BorderedSolver {
 public:
  explicit BorderedSolver(std::unique_ptr<LinearSolver> forest) : forest_(std::move(forest)) {}

  /// x holds the initial guess on entry, of which the forest's part is used. Without a border this
  /// is the forest's solve. Border rows that depend on the rest (their pivot is below 1e-12 of
  /// their diagonal) get the unknown zero, the others are solved for; the outcome is then
  /// not_positive_definite and `node` the number of forest nodes plus the first such row.
  /// Allocates nothing after the first call with a given structure.
  Report solve(const BorderedSystem& A, std::span<const double> b, std::span<double> x);

  /// Of the last solve: did this border row depend on the rest?
  bool depends(int row) const;

 private:
  int eliminate(const BorderedSystem& A);

  std::unique_ptr<LinearSolver> forest_;
  DenseTree schur_;            ///< of the border rows over the roots of their diagonals
  std::vector<double> right_;  ///< C^T, row after row, and b
  std::vector<double> z_;      ///< F^-1 of them
  std::vector<double> root_;   ///< of E's diagonal
  std::vector<double> y_;
};

}  // namespace linkwise
