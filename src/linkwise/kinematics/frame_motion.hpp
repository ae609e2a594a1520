#pragma once
// How a frame on a link moves: one walk along the elements between it and the ground.
#include "linkwise/model/frame.hpp"

namespace linkwise {

/// Of a frame against the world, in the frame's own axes.
struct FrameMotion {
  Transform<double> pose;  ///< world -> frame
  Motion<double> velocity;
  /// Second derivative of the origin's position, and derivative of the angular velocity.
  Motion<double> acceleration;
};

/// v, du [nv]: null where they are zero.
FrameMotion frame_motion(const Model& model, const double* q, const double* v, const double* du,
                         const FramePlacement& frame);

/// 6 x nv, row-major: the frame's velocity, linear first, is J u; along the world's axes, or its
/// own.
void frame_jacobian(const Model& model, const double* q, const FramePlacement& frame,
                    bool world_axes, double* J);

/// Both halves along the world's axes.
inline Motion<double> in_world_axes(const Transform<double>& pose, const Motion<double>& m) {
  return {transpose_times(pose.R, m.lin), transpose_times(pose.R, m.ang)};
}

}  // namespace linkwise
