#pragma once
// Symmetric matrices whose rows start late: of row i the lower triangle is kept from column first
// on. What lies left of it stays zero in the Cholesky factor, so a band costs as a band does.
#include <cstddef>
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

/// Solutions of least length of A x = b, where A is positive semidefinite and its largest
/// eigenvalues are about 1: A + mu 1 is factored, and x <- x + (A + mu 1)^-1 (b - A x) repeated. A
/// step leaves of the error in the direction of an eigenvalue l the part mu / (l + mu), and nothing
/// is added where l is zero. Which are zero it does not tell.
class ShiftedFactor {
 public:
  void factor(const Profile& profile, const std::vector<double>& A);
  /// How many pivots are larger than `least`, which is far above the shift.
  int rank_above(const Profile& profile, double least) const;
  /// x may be b. Returns the largest component of b - A x.
  double solve(const Profile& profile, const std::vector<double>& A, const double* b, double* x);

 private:
  void solve_once(const Profile& profile, double* x) const;

  std::vector<double> L_, given_, left_, more_, product_;
};

}  // namespace linkwise
