#pragma once
// Dense least squares whose matrix may lack rank or have rows of very different weight.
#include <cstddef>
#include <vector>

namespace linkwise {

/// A P = Q R by Householder reflections with column pivoting [golub2013, section 5.4.2], rows in
/// the order of their size, which keeps small rows accurate beside large ones [higham2002,
/// section 19.4].
class PivotedQr {
 public:
  /// A [m][n] row-major. Columns of which less than `null` is left count as zero.
  void factor(int m, int n, const double* A, double null);

  int rank() const { return rank_; }
  /// x [n] of the least |A x - b|, b [m], where the rank is n.
  void solve(const double* b, double* x);
  /// x [n] of A^T A x = b, b [n], where the rank is n.
  void solve_normal(const double* b, double* x);
  /// Orthonormal columns [n][rank] whose span A sees, and [n][n - rank] that it does not, each
  /// vector after the other.
  std::vector<double> seen() const;
  std::vector<double> unseen() const;

 private:
  const double* row(int i) const { return &R_[static_cast<size_t>(i) * n_]; }
  double* row(int i) { return &R_[static_cast<size_t>(i) * n_]; }
  void reflect(int k, double* x, size_t stride) const;

  int m_ = 0, n_ = 0, rank_ = 0;
  std::vector<int> rows_, order_;  ///< as given, in the order of the factor
  std::vector<double> R_;          ///< [m][n], below the diagonal what the reflections leave
  std::vector<double> v_, scale_;  ///< reflection k: 1 - scale v v^T, v [m] each
  std::vector<double> y_;
};

/// Makes vectors [count][n] orthonormal, in their order. None may depend on those before it.
void orthonormalise(int n, std::vector<double>& vectors);

}  // namespace linkwise
