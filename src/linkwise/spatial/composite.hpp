#pragma once
// Composite inertias: bodies as if frozen together.
#include "linkwise/spatial/inertia.hpp"

namespace linkwise {

/// Adds the inertia of a body, given in its frame, to the inertia of its parent; X takes motion of
/// the parent to the body.
inline void add_to_parent(const Transform<double>& X, const Inertia<double>& body,
                          Inertia<double>& parent) {
  ArticulatedInertia<double> Y;
  add_inertia(Y, body);
  const ArticulatedInertia<double> up = transform_to_parent(X, Y);
  parent.m += body.m;
  parent.mc += transpose_times(X.R, body.mc) + body.m * X.r;
  for (int i = 0; i < 6; ++i) parent.I.m[i] += up.C.m[i];
}

}  // namespace linkwise
