#pragma once
// Estimate of the A-norm error of an iteration from the decreases of that error.
//
// Every method here knows, almost for free, by how much an iteration lowered the squared A-norm of
// the error: D_k = ||e_k||^2 - ||e_{k+1}||^2 (conjugate gradients: step length times (z, r)
// [hestenes1952]; a relaxation: the squares of its local steps). The error left after iteration k
// is the sum of the decreases to come, ||e_{k+1}||^2 = D_{k+1} + D_{k+2} + ...  [strakos2002]. The
// ratio of that sum to D_k is read off the decreases so far: the largest ratio of "all that
// followed" to "this one" over the last two digits of convergence (the safeguard of [meurant2021]),
// and the geometric tail that the last decreases point to, which a slow linear iteration needs.

#include <vector>

namespace linkwise {

class EnergyEstimate {
 public:
  /// slowest_contraction: a rate that the iteration is known not to beat in the long run, or 0.
  void start(double slowest_contraction);
  /// Records the decrease of one iteration.
  void add(double decrease);
  /// Estimate of ||e||_A^2 now; infinity as long as nothing can be said.
  double squared_error() const;
  /// Sum of all decreases, ||e_0||^2 - ||e_now||^2.
  double total() const { return total_; }
  int count() const { return count_; }
  double last() const { return count_ > 0 ? at(count_ - 1) : 0.0; }
  /// Geometric mean of the last ratios of successive decreases (the square of the contraction).
  double contraction() const;

 private:
  // The window of two digits rarely holds more; a longer one only costs time.
  static constexpr int window = 256;
  double at(int k) const { return decrease_[k % window]; }

  std::vector<double> decrease_;
  double total_ = 0.0, slowest_contraction_ = 0.0;
  int count_ = 0;
};

}  // namespace linkwise
