#pragma once
// Kinematic and energetic quantities of one state. World frame: the root link's frame at fixed
// base.
#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

/// Pose of every joint's outboard (user) frame in the world, row-major 4x4 each, [n_joints][16].
void joint_poses(const Model& model, const double* q, double* poses);
/// Pose of every link of the file, merged ones too, [n_links][16].
void link_poses(const Model& model, const double* q, double* poses);
/// 1/2 sum v^T M v + 1/2 sum armature u^2, J.
double kinetic_energy(const Model& model, const double* q, const double* v);
/// -sum m g . r + springs + compliant stops, J; gravity's zero is the world origin.
/// loop_q: coordinates of joints that close loops, with turns counted; null: those nearest to zero.
double potential_energy(const Model& model, const double* q, const double* loop_q = nullptr);
/// Linear momentum and angular momentum about the world origin, world axes, [6].
void momentum(const Model& model, const double* q, const double* v, double* h);

}  // namespace linkwise
