#pragma once
// A symmetric positive definite matrix whose rows end early, factored as it stands: no pivoting,
// row after row, each taken from those below it as soon as it is known.
#include <cstddef>
#include <span>
#include <vector>

#include "linkwise/simd/lanes.hpp"

namespace linkwise {

class UpperRows {
 public:
  /// Columns are taken so many at a time.
  static constexpr int width = native_lanes < 4 ? native_lanes : 4;
  using Wide = Lanes<width>;

  UpperRows() = default;
  /// Row i has columns first[i] to last[i], of which those from i on are read. What is behind the
  /// last is zero, and may be written zeros to, as far as one `width`.
  UpperRows(std::span<const int> first, std::span<const int> last);

  int size() const { return static_cast<int>(last_.size()); }
  /// row(i)[j] is the entry in column j.
  double* row(int i) { return entries_.data() + start_[i]; }
  const double* row(int i) const { return entries_.data() + start_[i]; }
  int last(int i) const { return last_[i]; }
  void clear();

  /// A = U^T D^-1 U in place of A. False where a pivot is not above least[i].
  bool factor(const double* least);
  double pivot(int i) const { return row(i)[i]; }
  /// 1 / pivot.
  double inverse(int i) const { return inverse_[i]; }
  /// x <- A^-1 x. x has room for one `width` more, which holds zeros.
  void solve(double* x) const;

 private:
  std::vector<int> last_;
  std::vector<std::ptrdiff_t> start_;
  std::vector<double> entries_, inverse_;
};

}  // namespace linkwise
