#pragma once
// How far a step may go, so that nothing that acts from outside falls between two evaluations.
#include <vector>

#include "linkwise/forces/breakpoints.hpp"

namespace linkwise {

/// Of all inputs of a simulation. Times that are asked for mostly increase, so that a place is
/// remembered per input; the answers do not depend on it.
class StepLimits {
 public:
  /// Breakpoints up to t0 do not count. The inputs must outlive this.
  StepLimits(const std::vector<Breakpoints>& inputs, double t0);

  /// The latest end of a step that begins at t: the next breakpoint, of smooth ones the next but
  /// one; infinite after the last.
  double after(double t);
  /// Whether t is a breakpoint that is not smooth.
  bool breaks_at(double t);

 private:
  size_t next(size_t input, double t);

  const std::vector<Breakpoints>& inputs_;
  double t0_;
  std::vector<size_t> places_;
};

}  // namespace linkwise
