#pragma once
// A dense symmetric positive semidefinite system, such as constraints that repeat each other make.
#include <cstddef>
#include <vector>

namespace linkwise {

/// Cholesky factor with diagonal pivoting [golub2013, section 4.2.8]: with the rows in the order of
/// the pivots A = [L11; L21] [L11; L21]^T, L11 square of the size of the rank. Null vectors are the
/// columns of N = [-W^T; 1], W = L21 L11^-1.
class SemidefiniteFactor {
 public:
  /// A [n][n] row-major, of which the lower triangle is read. What pivots leave below `null` counts
  /// as zero: the rows are to be scaled so that this makes sense.
  void factor(int n, const double* A, double null);

  int size() const { return n_; }
  int rank() const { return rank_; }
  /// The row of pivot k, or -1 if that is zero.
  int taken(int k) const { return k < rank_ ? order_[k] : -1; }
  /// How many pivots are larger than `least`.
  int rank_above(double least) const;
  /// The last that was not zero, over the first; 1 if there are none.
  double smallest_pivot() const { return smallest_; }
  /// Of the solutions of A x = b the one of least length. Returns by how much b misses what A
  /// reaches: the largest component of N^T b.
  double solve(const double* b, double* x);
  /// Null vector k of size() - rank(), in the given order of the rows.
  void null_vector(int k, double* x) const;

 private:
  const double* row(int i) const { return &L_[static_cast<size_t>(i) * n_]; }
  double* row(int i) { return &L_[static_cast<size_t>(i) * n_]; }

  int n_ = 0, rank_ = 0;
  double smallest_ = 1;
  std::vector<int> order_;             ///< of the rows
  std::vector<double> L_;              ///< rows [n][n] in that order
  std::vector<double> diagonal_;       ///< what is left of it
  std::vector<double> W_, gram_;       ///< [n - rank][rank]; factor of 1 + W W^T
  std::vector<double> y_, t_, given_;  ///< of solve()
};

}  // namespace linkwise
