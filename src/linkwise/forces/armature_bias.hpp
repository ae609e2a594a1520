#pragma once
// What armatures add to the forces of joints whose rates turn with the child (floating, planar,
// spherical). The momentum D u of the armatures D changes along axes that turn at w, so
//     tau = ... + D du/dt + w x (D u)
// of the linear and of the angular rates alike [featherstone2008, 2.9, for a body's own inertia].
// The armatures of the linear rates are equal (model/validate.cpp), so u x (D u) is zero.
#include "linkwise/model/model.hpp"

namespace linkwise {

bool has_armature_bias(const Model& model, const Element& element);
bool has_armature_bias(const Model& model);
bool has_armature_bias(const LoopJoints& loops);

/// Adds factor times w x (D u) to tau [nv].
void add_armature_bias(const Model& model, const double* v, double factor, double* tau);
/// The same of joints that close loops: v and tau are theirs alone.
void add_armature_bias(const LoopJoints& loops, const double* v, double factor, double* tau);

}  // namespace linkwise
