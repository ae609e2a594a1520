#pragma once
// A rigid body behind its ports: what sweeps, constraint forces and energies ask of a body. A body
// of another kind answers the same functions (body_kinds.hpp).
//
// A port is a frame on a body where a joint meets it. Port 0, the inboard one, carries the body's
// frame. X_i takes the body's motion to port i, which does not move on a rigid body: the placement
// of the joint that meets it says where it is. Gravity is the acceleration -g of the ground, so no
// function is needed for the body's weight.
#include <span>
#include <string>

#include "linkwise/spatial/composite.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

template <class C>
struct RigidBody {
  static constexpr const char* name = "rigid";
  static constexpr int n_parameters = 0;
  static constexpr bool with_coordinates = false;  ///< of its own (own_coordinates.hpp)

  static std::string fault(std::span<const double>) { return ""; }
  /// A link as a body of this kind, in the link's frame.
  static RigidBody make(const RigidBody& link, std::span<const double>) { return link; }

  Inertia<C> inertia;  ///< about port 0, for the functions below alone
};

inline double mass(const RigidBody<double>& body) { return body.inertia.m; }

/// M a, the wrench at port 0 that an acceleration takes.
template <class C, class S>
LW_INLINE Force<Wider<C, S>> inertia_times(const RigidBody<C>& body, const Motion<S>& a) {
  return body.inertia * a;
}

/// Momentum at port 0 of a body that moves by v.
template <class C, class S>
LW_INLINE Force<Wider<C, S>> momentum(const RigidBody<C>& body, const Motion<S>& v) {
  return body.inertia * v;
}

/// The wrench that a body takes to keep its velocity: v x* momentum.
template <class C, class S>
LW_INLINE Force<Wider<C, S>> momentum_bias(const RigidBody<C>& body, const Motion<S>& v) {
  return cross_dual(v, momentum(body, v));
}

inline double kinetic_energy(const RigidBody<double>& body, const Motion<double>& v) {
  return 0.5 * dot(v, momentum(body, v));
}

/// In uniform gravity g of a body whose frame is X from the world's.
inline double potential_energy(const RigidBody<double>& body, const Transform<double>& X,
                               const Vec3<double>& g) {
  return -dot(g, body.inertia.m * X.r + transpose_times(X.R, body.inertia.mc));
}

/// Adds M, the body's contribution to an articulated inertia.
template <class S, class C>
LW_INLINE void add_inertia(ArticulatedInertia<S>& Y, const RigidBody<C>& body) {
  add_inertia(Y, body.inertia);
}

/// M as that of a rigid body: what is summed to a composite inertia.
inline const Inertia<double>& frozen_inertia(const RigidBody<double>& body) { return body.inertia; }

/// Acceleration of port 0 per wrench on it, all else left free: C_00 = M^-1. The inertia must be
/// regular.
inline Compliance<double> compliance(const RigidBody<double>& body) {
  return invert_inertia(body.inertia);
}

/// Acceleration of port i per wrench on port 0: C_i0 = X_i C_00.
inline Matrix6<double> compliance(const RigidBody<double>&, const Compliance<double>& inboard,
                                  const Transform<double>& X_i) {
  const Matrix6<double> C = to_matrix(inboard);  // symmetric: rows are columns
  Matrix6<double> out;
  for (int j = 0; j < 6; ++j) {
    const Vector6<double> column = to_array(X_i * to_motion(&C[6 * j]));
    for (int i = 0; i < 6; ++i) out[6 * i + j] = column[i];
  }
  return out;
}

/// Acceleration of port i per wrench on port j: C_ij = C_i0 X_j^T.
inline Matrix6<double> compliance(const RigidBody<double>&, const Matrix6<double>& from_inboard,
                                  const Transform<double>& X_j) {
  Matrix6<double> out;
  for (int i = 0; i < 6; ++i) {
    const Vector6<double> row = to_array(X_j * to_motion(&from_inboard[6 * i]));
    for (int j = 0; j < 6; ++j) out[6 * i + j] = row[j];
  }
  return out;
}

/// The same body given in the frame that X starts from; X leads to the one it is given in.
inline RigidBody<double> moved(const RigidBody<double>& body, const Transform<double>& X) {
  return {transform_to_parent(X, body.inertia)};
}

/// Turns with one kilogram and one kilogram metre squared about every axis, and has no motion
/// coupled: for places of a lane where there is no body but an inertia must be regular.
inline RigidBody<double> unit_body() { return {{1, {}, {{1, 0, 1, 0, 0, 1}}}}; }

}  // namespace linkwise
