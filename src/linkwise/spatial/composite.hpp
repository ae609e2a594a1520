#pragma once
// Composite inertias: bodies as if frozen together.
#include "linkwise/spatial/inertia.hpp"

namespace linkwise {

/// X^T M X: a rigid body's inertia seen at the parent frame.
inline Inertia<double> transform_to_parent(const Transform<double>& X, const Inertia<double>& M) {
  ArticulatedInertia<double> Y;
  add_inertia(Y, M);
  return {M.m, transpose_times(X.R, M.mc) + M.m * X.r, transform_to_parent(X, Y).C};
}

/// Two bodies as if frozen together, both given in one frame.
inline void operator+=(Inertia<double>& a, const Inertia<double>& b) {
  a.m += b.m;
  a.mc += b.mc;
  for (int i = 0; i < 6; ++i) a.I.m[i] += b.I.m[i];
}

/// Adds the rotational inertia m (c.c 1 - c c^T) of a point mass at c.
inline void add_point_mass(Sym3<double>& I, double m, const Vec3<double>& c) {
  I.m[0] += m * (c.y * c.y + c.z * c.z);
  I.m[1] -= m * c.x * c.y;
  I.m[2] += m * (c.x * c.x + c.z * c.z);
  I.m[3] -= m * c.x * c.z;
  I.m[4] -= m * c.y * c.z;
  I.m[5] += m * (c.x * c.x + c.y * c.y);
}

}  // namespace linkwise
