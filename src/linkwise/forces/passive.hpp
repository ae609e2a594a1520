#pragma once
// Forces that the joints exert by themselves: viscous damping, smoothed Coulomb friction, springs
// and compliant stops at the position limits.
#include "linkwise/model/model.hpp"

namespace linkwise {

/// Adds to tau [nv]: -damping u - friction tanh(u / friction_velocity) - stiffness (q - rest)
/// with linear rates u of floating and planar joints along the axes of the previous frame,
/// and at a limit passed by depth x > 0 with speed s outward: limit_stiffness x max(0, 1 +
/// limit_damping s) back inward [hunt1975].
void add_passive_forces(const Model& model, const double* q, const double* v, double* tau);

/// The same of joints that close loops: q, v and tau are theirs alone.
void add_passive_forces(const LoopJoints& loops, const double* q, const double* v, double* tau);

bool has_passive_forces(const LoopJoints& loops);

/// Energy stored in springs and stops, J.
double passive_potential(const Model& model, const double* q);
/// The same of joints that close loops: q is theirs alone.
double passive_potential(const LoopJoints& loops, const double* q);

}  // namespace linkwise
