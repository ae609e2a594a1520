#pragma once
// Symmetric matrices whose rows start late: of row i the lower triangle is kept from column first
// on. What lies left of it stays zero in the Cholesky factor, so a band costs as a band does.
#include <cstddef>
#include <span>
#include <vector>

namespace linkwise {

class Profile {
 public:
  explicit Profile(std::vector<int> first = {});

  int size() const { return static_cast<int>(first_.size()); }
  int first(int row) const { return first_[row]; }
  size_t n_entries() const { return start_.back(); }
  /// Row of a matrix with this profile, so that row(...)[j] is its entry in column j >= first.
  template <class T>
  T* row(T* entries, int i) const {
    return entries + start_[i] - first_[i];
  }

 private:
  std::vector<int> first_;
  std::vector<size_t> start_;  ///< of each row among the entries, and their number
};

/// y = A x.
void multiply(const Profile& profile, const double* A, const double* x, double* y);

/// Consecutive rows that start in the same column.
struct RowBlock {
  int row, n;
};

/// Cholesky factor of a positive semidefinite matrix in the order of its blocks of rows, with
/// pivoting inside each. Rows that depend on those before them are left out, so that it tells which
/// directions are null or weak at the cost of a band; pivoting inside a block keeps those that are
/// taken far from dependent where a block repeats itself.
class ProfileFactor {
 public:
  /// The blocks hold all rows. What pivots leave below `null` counts as zero.
  void factor(const Profile& profile, std::span<const RowBlock> blocks,
              const std::vector<double>& A, double null);

  int rank() const { return rank_; }
  /// The row of pivot k, or -1 if that is zero.
  int taken(int k) const { return pivot_[k] > 0 ? order_[k] : -1; }
  /// How many pivots are larger than `least`.
  int rank_above(double least) const;
  /// The least over the largest that are not zero; 1 if there are none.
  double smallest_pivot() const;
  /// The solution of A x = b that is zero in the rows that are left out; x may be b. Returns by how
  /// much b misses what A reaches: the largest component of b - A x.
  double solve(const Profile& profile, const std::vector<double>& A, const double* b, double* x);

 private:
  void eliminate(const Profile& profile, RowBlock block, int j, const std::vector<double>& A);
  void factor_block(const Profile& profile, RowBlock block, const std::vector<double>& A,
                    double null);
  void solve_once(const Profile& profile, const double* b, double* x);

  int rank_ = 0;
  std::vector<int> order_;         ///< of the rows
  std::vector<double> L_, pivot_;  ///< rows in that order; pivots, 0 of rows that are left out
  std::vector<double> given_, left_, more_, product_, y_;  ///< of solve()
};

/// Solutions of least length of A x = b, where A is positive semidefinite and its largest
/// eigenvalues are about 1: A + mu 1 is factored, and x <- x + (A + mu 1)^-1 (b - A x) repeated. A
/// step leaves of the error in the direction of an eigenvalue l the part mu / (l + mu), and nothing
/// is added where l is zero.
class ShiftedFactor {
 public:
  void factor(const Profile& profile, const std::vector<double>& A);
  /// x may be b. Returns the largest component of b - A x.
  double solve(const Profile& profile, const std::vector<double>& A, const double* b, double* x);

 private:
  void solve_once(const Profile& profile, double* x) const;

  std::vector<double> L_, given_, left_, more_, product_;
};

}  // namespace linkwise
