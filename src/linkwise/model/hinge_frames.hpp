#pragma once
// Frames that make the sweeps cheap. A body on one axis may turn its frame about that axis and
// slide it along: both leave the joint's equations as they are. Its frame is put where the common
// normal to the axis of its first revolute child leaves its own axis, x along the normal, which
// gives the child the placement of [denavit1955]: two planar rotations and two shifts along axes
// instead of a full rotation and translation, less than half the arithmetic of an inertia's
// transform.
#include "linkwise/model/make_bodies.hpp"

namespace linkwise {

/// Chooses the frames of all bodies whose axes are along z, moves what is expressed in them
/// (placements, inertias, the way back to the user's frames), and marks hinges. Common normals that
/// lie far away (nearly parallel axes) are left alone: a distant origin would cost digits.
void choose_hinge_frames(Bodies& bodies, PlacedJoints& placed);

}  // namespace linkwise
