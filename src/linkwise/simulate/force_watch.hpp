#pragma once
// How well forces of large gain are known along a run: an error test sees to it where steps are
// chosen, and fixed steps are looked at. y is the integrator's, with rates in parent axes:
// positions of all members, then their rates.
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "linkwise/simulate/applied_forces.hpp"
#include "linkwise/simulate/fixed_step_forces.hpp"
#include "linkwise/simulate/force_accuracy.hpp"

namespace linkwise {

class ForceWatch {
 public:
  /// What it asks about states that the integrator has.
  struct Host {
    std::function<void(double t, double* y)> to_state;  ///< as LoopWatch takes it
    std::function<void(const double* y, double* scale)> error_scale;
    /// The state accepted last, at time t, and its derivative: zeros where that is not known.
    std::function<void(double t, double* y, double* ydot)> evaluate;
  };

  /// Setup and forces must outlive this.
  ForceWatch(const Setup& setup, AppliedForces& forces, size_t members, Host host);
  ForceWatch(const ForceWatch&) = delete;  // its parts point at each other
  ForceWatch& operator=(const ForceWatch&) = delete;

  void start(double t, const double* y);
  /// After each evaluation of the integrator, of all members; those that have ended are passed
  /// over.
  void evaluated(double t, const double* y, const double* ydot, std::span<const Ending> endings);
  /// At the end of each step; breaks: what acts jumps there.
  void accepted(double t, const double* y, bool breaks, std::span<const Ending> endings);

  // As OdeSystem has them.
  void limit_errors(const double* y, double* allowed) const;
  bool has_jumped() const { return accuracy_ && accuracy_->has_jumped(); }
  bool retakes(double begin, double end, const double* y,
               const std::function<void(double, double*)>& state);
  double step_limit(double t);

  /// One line where forces of a member are not known well, with the remedy; else empty.
  std::string doubt(size_t member) const;
  /// With fixed steps: how much of the largest force that is; 0 where they are known well.
  double error(size_t member) const;

 private:
  size_t position_size() const { return members_ * nq_; }
  size_t size() const { return members_ * (nq_ + nv_); }
  const double* rates_in(const double* y) const { return y + position_size(); }
  /// Of one member, with what closes loops where that is watched.
  std::pair<const double*, const double*> watched(double t, const double* y, size_t member);
  void keep_acting(const double* ydot);
  void weigh(double t, const double* y);

  const Setup& setup_;
  AppliedForces& forces_;
  size_t members_, nq_, nv_;
  Host host_;
  std::unique_ptr<LoopWatch> loops_;       ///< null: nothing that closes loops has a gain
  std::optional<ForceAccuracy> accuracy_;  ///< of one member, with an error test
  std::vector<FixedStepForces> fixed_;     ///< of each member; none: steps are chosen
  std::vector<double> acting_;             ///< of the last evaluation: derivatives of y, torques
  std::vector<double> scale_, closed_;
};

}  // namespace linkwise
