#pragma once
// What acts on the members of a simulation from outside, at one time: drives, wrenches, and the
// joints' own forces.
#include <optional>
#include <vector>

#include "linkwise/simulate/loop_forces.hpp"

namespace linkwise {

class AppliedForces {
 public:
  /// The setup must outlive this. constant: torques [members][nv] beside the drives, or null.
  AppliedForces(const Setup& setup, size_t members, const double* constant);

  /// q [members][nq], v [members][nv].
  void evaluate(double t, const double* q, const double* v);

  const double* tau(size_t member) const { return tau_.data() + member * nv_; }
  /// The drives' share of tau.
  const double* drive(size_t member) const { return drive_.data() + member * nv_; }
  /// [n_joints][6]; null where there are no wrenches.
  const double* external(size_t member) const {
    return external_.empty() ? nullptr : external_.data() + member * n_load_;
  }

  /// Of joints that close loops; null where there are none.
  LoopForces* loops() { return loops_ ? &*loops_ : nullptr; }
  const LoopForces* loops() const { return loops_ ? &*loops_ : nullptr; }

  /// The joint whose torque or wrench is not finite, or -1.
  int joint_with_bad_force(size_t member) const;

  /// Adds to drive() the torques of joints of given motion: `total`, the torques [members][nv] that
  /// their accelerations take, less what acts by itself.
  void add_holding_torques(const double* total);
  /// The same of one member: to `drive` [nv], of the applied torques `tau`.
  void add_holding_torques(const double* total, const double* tau, double* drive) const;

 private:
  const Setup& setup_;
  size_t members_, nv_, n_load_;
  bool world_wrenches_ = false;
  std::optional<LoopForces> loops_;
  std::vector<double> constant_, tau_, drive_, external_, poses_;
};

}  // namespace linkwise
