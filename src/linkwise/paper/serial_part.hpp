#pragma once
// The part of the method of constraint forces that no number of processors shortens, T_serial of
// [sharf1993, eqs. (20), (21)], to be timed. With one processor per body, everything about a body
// or a joint is done at once, save
// - the sums of the iteration (inner products, norms): one number per body, added up one by one;
// - with joint coordinates as the state, passing velocities outward from body to body. The paper's
//   own state, the bodies' absolute velocities, needs no such pass.
#include <vector>

#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

class SerialPart {
 public:
  /// The model must outlive this.
  SerialPart(const Model& model, const double* q, const double* v);

  /// 1 + 1/2 + ... + 1/n_bodies, added up `sums` times.
  void add(int sums);
  double sum() const { return sum_; }

  /// Velocities of the bodies, each its parent's and what its joint adds.
  void pass_velocities();
  const std::vector<Motion<double>>& velocities() const { return velocity_; }

 private:
  const Model& model_;
  std::vector<BodyState<double>> state_;
  std::vector<Motion<double>> own_;  ///< the joints' shares, which their processors have ready
  std::vector<Motion<double>> velocity_;
  std::vector<double> part_;
  // What the compiler cannot foresee, so that it keeps the loops.
  volatile double zero_ = 0, sum_ = 0;
};

}  // namespace linkwise
