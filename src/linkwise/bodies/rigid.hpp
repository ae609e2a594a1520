#pragma once
// A rigid body behind its ports: what the steps of every recursion ask of a body. Port 0 is the
// inboard one and carries the body's frame; all others move with it.
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

/// Its ten numbers, about the inboard port.
template <class C>
using RigidBody = Inertia<C>;

/// Momentum at the inboard port of a body that moves by v; of an acceleration, the wrench that it
/// takes.
template <class C, class S>
LW_INLINE Force<Wider<C, S>> momentum(const RigidBody<C>& body, const Motion<S>& v) {
  return body * v;
}

/// The wrench that a body takes to keep its velocity: v x* (M v).
template <class C, class S>
LW_INLINE Force<Wider<C, S>> momentum_bias(const RigidBody<C>& body, const Motion<S>& v) {
  return cross_dual(v, body * v);
}

/// Acceleration of the inboard port per wrench on it, all else left free: M^-1. The inertia must be
/// regular.
inline Compliance<double> compliance(const RigidBody<double>& body) { return invert_inertia(body); }

}  // namespace linkwise
