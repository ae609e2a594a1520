#pragma once

namespace linkwise {

/// What an evaluation saw of the loops.
struct LoopReport {
  int rows = 0;               ///< directions that loop joints and couplings hold
  int rank = 0;               ///< how many are independent
  int strong = 0;             ///< how many are far from dependent
  double smallest_pivot = 1;  ///< of what counts as independent, over the largest
  /// By how much dependent constraints contradict each other, over what all ask for: rounding
  /// errors, unless the position is singular or the state is not consistent.
  double contradiction = 0;
  double open = 0;  ///< the widest gap of a loop, or slip, over its length, or speed
  bool is_contradictory() const { return !(contradiction < 1e-6 + 100 * open); }
};

}  // namespace linkwise
