#pragma once
// Lambda f = b of one group of loops, and the metric D in which the least f is taken where many
// solve it. In coordinates in which D is 1 a small Lambda is factored by pivoting, and a large one
// in the order of its rows, so that a row of many loops costs what is in its band. The least f is
// then a second factor, made for loads alone: accelerations are the same for all f.
#include <array>
#include <vector>

#include "linkwise/dynamics/loop_groups.hpp"
#include "linkwise/linear/profile.hpp"
#include "linkwise/linear/semidefinite.hpp"

namespace linkwise {

class LoopSystem {
 public:
  explicit LoopSystem(const LoopGroup& group);

  /// Of the longest row, left of its diagonal.
  int width() const;
  void clear();
  /// Row i of Lambda, of which columns j <= i are asked.
  double* row(int i) { return profile_.row(Lambda_.data(), i); }
  /// D of a member, lower triangle, packed.
  double* metric(size_t member) { return metric_[member].data(); }
  /// Pivots below `null` count as zero. least: the least f is asked for.
  void factor(double null, bool least);

  int rank() const { return is_small() ? exact_.rank() : banded_.rank(); }
  /// Which rows the last factor took as independent.
  std::vector<char> independent() const;
  double smallest_pivot() const {
    return is_small() ? exact_.smallest_pivot() : banded_.smallest_pivot();
  }
  /// How many pivots are larger than `least`.
  int rank_above(double least) const {
    return is_small() ? exact_.rank_above(least) : banded_.rank_above(least);
  }
  /// x <- Lambda^+ x. Returns by how much the constraints contradict each other, where D is 1.
  double solve(std::vector<double>& x);
  /// What a number asked of row i is where D is 1, or a bound of it.
  double scale(size_t member, int k) const { return metric_[member][packed(k, k)]; }

  // Null vectors, after factor_exactly(), which is dense.
  void factor_exactly(double null = 1e-10);
  int n_null() const { return exact_.size() - exact_.rank(); }
  void null_vector(int k, std::vector<double>& f) const;
  /// Null vectors [n][rows] of the last factor, f^T D f = 1 and 0 between them. Returns n.
  int null_basis(double null, std::vector<double>& f);

 private:
  bool is_small() const { return profile_.size() <= 64; }
  void scale_matrix();
  double solve_large(double* x);
  void to_scaled(double* x) const;
  void from_scaled(double* x) const;

  std::vector<RowBlock> blocks_;  ///< by member
  Profile profile_;
  std::vector<double> Lambda_, scaled_, dense_;
  std::vector<std::array<double, 21>> metric_;  ///< D, then its factor
  SemidefiniteFactor exact_;
  ProfileFactor banded_;
  ShiftedFactor shifted_;
  bool least_ = false;
  std::vector<double> rest_, product_;
};

}  // namespace linkwise
