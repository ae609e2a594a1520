#pragma once
// What one evaluation of a machine with closed loops takes by the one way and by the other.
#include "linkwise/model/model.hpp"

namespace linkwise {

/// Multiplications, counted over the structure.
struct LoopWork {
  /// Of the recursion (ArticulatedLoops): along the paths of the loops, and of the factor of what
  /// is left where they meet.
  double recursion = 0;
  /// Of A f = b of all joints (LoopedConstraintForce); counted only where the recursion has so much
  /// to do that it may matter, and as far as it may be less. Infinite where it does not take the
  /// machine.
  double graph = 0;
  /// Is the graph worth it? It assembles more, so only where it saves more than half.
  bool prefers_graph() const { return 2 * graph < recursion; }
};

LoopWork count_loop_work(const Model& model);

}  // namespace linkwise
