#pragma once

#include <cmath>
#include <cstddef>
#include <span>

#include "linkwise/integrate/integrator.hpp"

namespace linkwise {

inline bool all_finite(std::span<const double> values) {
  // One product decides for all: 0 * x is NaN exactly where x is not finite.
  double sum = 0.0;
  for (const double value : values) sum += 0.0 * value;
  return sum == 0.0;
}

/// An OdeSystem whose evaluations are counted and checked to be finite.
class CheckedSystem {
 public:
  explicit CheckedSystem(OdeSystem& system) : system_(&system) {}

  Outcome evaluate(double t, const double* y, double* ydot) {
    ++evaluations;
    const Outcome outcome = system_->evaluate(t, y, ydot);
    if (outcome != Outcome::converged) return outcome;
    return all_finite({ydot, size()}) ? Outcome::converged : Outcome::not_finite;
  }

  std::size_t size() const { return static_cast<std::size_t>(system_->size()); }
  std::size_t position_size() const { return static_cast<std::size_t>(system_->position_size()); }
  OdeSystem& operator*() const { return *system_; }
  OdeSystem* operator->() const { return system_; }

  long evaluations = 0;

 private:
  OdeSystem* system_;
};

}  // namespace linkwise
