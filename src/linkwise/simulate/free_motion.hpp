#pragma once
// What closed loops leave free to move. Joints that they hold, such as the second axis of a
// universal joint in a planar linkage, have no error beyond rounding, whatever the error test lets
// pass before the loops are closed again. Torques of all joints at once, each of the size of the
// inertia that it feels in the open tree, move everything that can move.
#include <vector>

#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/dynamics/mobility.hpp"

namespace linkwise {

class FreeMotion {
 public:
  /// The model must outlive it.
  explicit FreeMotion(const Model& model);

  /// At q [nq] of the tree, which closes the loops; loop_q: as of SweepInput. False where nothing
  /// can be said: then everything counts as free.
  bool evaluate(const double* q, const double* loop_q);
  /// Accelerations that the torques have added, [nv], and the largest of them.
  const std::vector<double>& moved() const { return moved_; }
  double largest() const { return largest_; }

  /// Of what moves this share or less is rounding.
  static constexpr double held = 1e-10;

 private:
  const Model& model_;
  Mobility mobility_;
  ArticulatedLoops kernel_;
  std::vector<double> tau_, rests_, moved_;
  double largest_ = 0;
};

}  // namespace linkwise
