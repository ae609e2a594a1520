#pragma once
// How a body sits on its parent at one instant. Every placement answers the same three questions,
//     to_child(v) = X v,    to_parent(f) = X^T f,    to_parent(Y) = X^T Y X,
// so that a step is written once, whatever the joint and wherever X is kept.
#include "linkwise/model/model.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

inline HingePlacement<double> placement(const BodyConstants<double>& k) {
  return {k.cos_alpha, k.sin_alpha, k.a, k.d};
}

/// A hinge: four constants and the turn about z.
template <class C, class S>
struct TurnedHinge {
  HingePlacement<C> constants;
  S cosine, sine;

  LW_INLINE Motion<S> to_child(const Motion<S>& v) const {
    return linkwise::to_child(constants, cosine, sine, v);
  }
  LW_INLINE Force<S> to_parent(const Force<S>& f) const {
    return linkwise::to_parent(constants, cosine, sine, f);
  }
  LW_INLINE ArticulatedInertia<S> to_parent(const PlanarInertia<S>& Y) const {
    return linkwise::to_parent(constants, cosine, sine, Y);
  }
};

/// Any joint: the whole transform.
template <class S>
struct Pose {
  const Transform<S>& X;

  LW_INLINE Motion<S> to_child(const Motion<S>& v) const { return X * v; }
  LW_INLINE Force<S> to_parent(const Force<S>& f) const { return transpose_times(X, f); }
  template <class Y>
  LW_INLINE ArticulatedInertia<S> to_parent(const Y& inertia) const {
    return transform_to_parent(X, inertia);
  }
};

// Across a joint of one axis in two steps: from the parent's frame to the joint's by constants of
// the model, then its motion about and along z. Sweeps that never need the product of both skip it.

/// How far a joint of one axis has moved; what its kind does not move is not read.
template <class S>
struct AxisPose {
  S cosine, sine;  ///< of the turn about z
  S slide;         ///< along z
};

template <class J, class S>
LW_INLINE void calc_axis_pose(const BodyConstants<double>& k, const S& q, AxisPose<S>& at) {
  if constexpr (J::turns) sincos(S(q + (J::is_hinge ? k.theta : 0.0)), at.sine, at.cosine);
  if constexpr (J::slides) at.slide = J::turns ? S(k.pitch * q) : q;
}

/// Parent frame -> frame of the body before its joint's motion.
template <class J, class T>
LW_INLINE Motion<T> before_motion(const BodyConstants<double>& k, const Motion<T>& v) {
  if constexpr (J::is_hinge)
    return to_child(placement(k), v);
  else
    return k.tree * v;
}
/// And wrenches back.
template <class J, class S>
LW_INLINE Force<S> at_parent(const BodyConstants<double>& k, const Force<S>& f) {
  if constexpr (J::is_hinge)
    return to_parent(placement(k), f);
  else
    return transpose_times(k.tree, f);
}

/// Frame before the joint's motion -> body frame.
template <class J, class S>
LW_INLINE Motion<S> after_motion(const AxisPose<S>& at, Motion<S> v) {
  if constexpr (J::slides) {
    v.lin.x += at.slide * v.ang.y;
    v.lin.y -= at.slide * v.ang.x;
  }
  if constexpr (J::turns) {
    turn(at.cosine, S(-at.sine), v.lin.x, v.lin.y);
    turn(at.cosine, S(-at.sine), v.ang.x, v.ang.y);
  }
  return v;
}
template <class J, class S>
LW_INLINE void apply_motion(const AxisPose<S>& at, Force<S>& f) {
  if constexpr (J::slides) {
    f.ang.x += at.slide * f.lin.y;
    f.ang.y -= at.slide * f.lin.x;
  }
  if constexpr (J::turns) {
    turn(at.cosine, S(-at.sine), f.lin.x, f.lin.y);
    turn(at.cosine, S(-at.sine), f.ang.x, f.ang.y);
  }
}

/// The placement that takes the two steps.
template <class J, class S>
struct MovedAxis {
  const BodyConstants<double>& constants;
  const AxisPose<S>& at;

  LW_INLINE Motion<S> to_child(const Motion<S>& v) const {
    return after_motion<J>(at, before_motion<J>(constants, v));
  }
};

/// Body frame -> frame before the joint's motion.
template <class J, class S>
LW_INLINE void undo_motion(const AxisPose<S>& at, Motion<S>& v) {
  if constexpr (J::turns) {
    turn(at.cosine, at.sine, v.lin.x, v.lin.y);
    turn(at.cosine, at.sine, v.ang.x, v.ang.y);
  }
  if constexpr (J::slides) {
    v.lin.x -= at.slide * v.ang.y;
    v.lin.y += at.slide * v.ang.x;
  }
}
template <class J, class S>
LW_INLINE void undo_motion(const AxisPose<S>& at, Compliance<S>& L) {
  if constexpr (J::turns) turn_back(at.cosine, at.sine, L);
  if constexpr (J::slides) slide_back(at.slide, L);
}

}  // namespace linkwise
