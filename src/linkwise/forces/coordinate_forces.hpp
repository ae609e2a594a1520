#pragma once
// Forces along coordinates. A planar joint's coordinates x, y lie in the parent's plane while its
// rates are those of the child's frame, so springs, stops and position control on them must be
// turned into that frame, or they would do work around a closed path.
#include <cmath>

#include "linkwise/joints/element.hpp"

namespace linkwise {

/// Are all coordinates of the element angles and distances, one per degree of freedom?
inline bool has_scalar_coordinates(const Element& e) { return e.nq == e.nv; }

/// dq/dt of such an element, [e.nv].
inline void scalar_rates(const Element& e, const double* q, const double* v, double* rate) {
  for (int k = 0; k < e.nv; ++k) rate[k] = v[e.v + k];
  if (e.kind != ElementKind::planar) return;
  const double c = std::cos(q[e.q + 2]), s = std::sin(q[e.q + 2]);
  rate[0] = c * v[e.v] - s * v[e.v + 1];
  rate[1] = s * v[e.v] + c * v[e.v + 1];
}

/// Adds to the forces along its rates the share of the forces along its coordinates, [e.nv]. It is
/// the transpose of the above, so the power is the same.
inline void add_coordinate_forces(const Element& e, const double* q, const double* force,
                                  double* tau) {
  if (e.kind != ElementKind::planar) {
    for (int k = 0; k < e.nv; ++k) tau[e.v + k] += force[k];
    return;
  }
  const double c = std::cos(q[e.q + 2]), s = std::sin(q[e.q + 2]);
  tau[e.v] += c * force[0] + s * force[1];
  tau[e.v + 1] += c * force[1] - s * force[0];
  tau[e.v + 2] += force[2];
}

}  // namespace linkwise
