#pragma once
// The part of an evaluation by constraint forces that no number of processors shortens: T_serial of
// [sharf1993, eqs. (20), (21)]. With one processor a body, everything about a body or a joint is
// done at once, save
// - the sums of the iteration (inner products, norms): one number a body, added up one by one;
// - with joint coordinates as the state, passing velocities outward from body to body. The paper's
//   own state, the bodies' absolute velocities, needs no such pass.
#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

/// Seconds an evaluation.
struct SerialPart {
  double sums = 0, velocities = 0;
};

/// Times the two, `repeats` times over. `sums`: number of sums over all bodies an evaluation.
SerialPart measure_serial_part(const Model& model, const SweepInput<double>& in, int sums,
                               int repeats);

}  // namespace linkwise
