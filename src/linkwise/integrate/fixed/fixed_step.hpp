#pragma once

#include <span>
#include <vector>

#include "linkwise/integrate/checked_system.hpp"
#include "linkwise/integrate/integrator.hpp"

namespace linkwise {

/// What the fixed-step methods share. Steps end at t0 + k h, whatever output is asked for, and t is
/// computed as that product, so it does not drift from the grid. A step is cut in two where the
/// system's step_limit() falls into it.
class FixedStep : public Integrator {
 public:
  FixedStep(OdeSystem& system, const IntegratorOptions& options);

  void start(double t0, std::span<const double> y0) final;
  Outcome step(double t_limit) final;
  void interpolate(double t, std::span<double> y) final;
  double time() const final { return time_; }
  IntegratorStatistics statistics() const final;

 protected:
  virtual int order() const = 0;
  /// Forgets the previous run; y() holds the initial state.
  virtual void prepare() {}
  /// Forgets the rates at time(), where the system breaks.
  virtual void renew() {}
  /// Computes next() at t + h from y() at t. After `converged` it becomes y(), and y() becomes
  /// previous().
  virtual Outcome advance(double t, double h) = 0;
  /// Writes the interpolant at the fraction s of the last step, of length h().
  virtual void interpolate_fraction(double s, std::span<double> y) = 0;

  const std::vector<double>& previous() const { return previous_; }
  const std::vector<double>& y() const { return y_; }
  std::vector<double>& next() { return next_; }
  double h() const { return last_step_; }

  CheckedSystem system_;

 private:
  double h_;
  long max_steps_;
  double start_time_ = 0.0;
  double time_ = 0.0;
  double last_step_ = 0.0;
  bool on_grid_ = true, renewal_due_ = false;
  long whole_steps_ = 0, steps_ = 0;  ///< of the grid; with the parts of those that were cut
  std::vector<double> previous_, y_, next_;
};

}  // namespace linkwise
