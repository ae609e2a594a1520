#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "linkwise/base/finite.hpp"
#include "linkwise/integrate/integrator.hpp"

namespace linkwise {

/// An OdeSystem whose evaluations are counted, checked to be finite, and made on one side of the
/// times at which the system breaks.
class CheckedSystem {
 public:
  explicit CheckedSystem(OdeSystem& system) : system_(&system) {}

  /// Before each step: the latest time at which it may end.
  double begin_step(double t) {
    const double limit = system_->step_limit(t);
    earliest_ = system_->breaks_at(t) ? beside(t, infinity) : -infinity;
    latest_ = limit < infinity && system_->breaks_at(limit) ? beside(limit, -infinity) : infinity;
    return limit;
  }

  Outcome evaluate(double t, const double* y, double* ydot) {
    ++evaluations;
    const Outcome outcome = system_->evaluate(within_step(t), y, ydot);
    if (outcome != Outcome::converged) return outcome;
    return all_finite({ydot, size()}) ? Outcome::converged : Outcome::not_finite;
  }

  /// Neither counted nor remembered.
  Outcome evaluate_aside(double t, const double* y, double* ydot) {
    return system_->evaluate_aside(within_step(t), y, ydot);
  }

  std::size_t size() const { return static_cast<std::size_t>(system_->size()); }
  std::size_t position_size() const { return static_cast<std::size_t>(system_->position_size()); }
  OdeSystem& operator*() const { return *system_; }
  OdeSystem* operator->() const { return system_; }

  long evaluations = 0;

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();

  /// The next time, a few roundings away because a function of the caller's may round t as well.
  static double beside(double t, double towards) {
    for (int k = 0; k < 4; ++k) t = std::nextafter(t, towards);
    return t;
  }

  double within_step(double t) const {
    return std::clamp(t, earliest_, std::max(earliest_, latest_));
  }

  double earliest_ = -infinity, latest_ = infinity;
  OdeSystem* system_;
};

}  // namespace linkwise
