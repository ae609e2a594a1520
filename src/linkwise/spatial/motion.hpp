#pragma once
// Spatial motion and force vectors, linear part first, and the transform between two frames
// [featherstone2008, with the order of the parts as in NOTATION.md].
#include "linkwise/spatial/vec3.hpp"

namespace linkwise {

/// Velocity or acceleration of a frame: v of its origin, w of its axes, in its own components.
template <class S>
struct Motion {
  Vec3<S> lin, ang;
};

/// Force and moment about the frame's origin, in the frame's components.
template <class S>
struct Force {
  Vec3<S> lin, ang;
};

template <class A, class B>
LW_INLINE Motion<A>& operator+=(Motion<A>& a, const Motion<B>& b) {
  a.lin += b.lin;
  a.ang += b.ang;
  return a;
}
template <class A, class B>
LW_INLINE Force<A>& operator+=(Force<A>& a, const Force<B>& b) {
  a.lin += b.lin;
  a.ang += b.ang;
  return a;
}
template <class A, class B>
LW_INLINE Force<A>& operator-=(Force<A>& a, const Force<B>& b) {
  a.lin -= b.lin;
  a.ang -= b.ang;
  return a;
}
template <class A, class B>
LW_INLINE Motion<Wider<A, B>> operator*(const A& s, const Motion<B>& v) {
  return {s * v.lin, s * v.ang};
}
template <class A, class B>
LW_INLINE Force<Wider<A, B>> operator*(const A& s, const Force<B>& f) {
  return {s * f.lin, s * f.ang};
}
/// to = f, component by component. A copy of the whole may go through memory. If the components
/// were just computed, it would read in wide words what was written in narrow ones: a stall of a
/// dozen cycles.
template <class Spatial>
LW_INLINE void store(Spatial& to, const Spatial& f) {
  to.lin.x = f.lin.x;
  to.lin.y = f.lin.y;
  to.lin.z = f.lin.z;
  to.ang.x = f.ang.x;
  to.ang.y = f.ang.y;
  to.ang.z = f.ang.z;
}

template <class A, class B>
LW_INLINE Wider<A, B> dot(const Motion<A>& v, const Force<B>& f) {
  return dot(v.lin, f.lin) + dot(v.ang, f.ang);
}

/// Motion cross product (v,w) x (a,b) = (w x a + v x b, w x b).
template <class A, class B>
LW_INLINE Motion<Wider<A, B>> cross(const Motion<A>& v, const Motion<B>& m) {
  return {cross(v.ang, m.lin) + cross(v.lin, m.ang), cross(v.ang, m.ang)};
}
/// Force cross product v x* f = (w x f_l, w x f_a + v x f_l).
template <class A, class B>
LW_INLINE Force<Wider<A, B>> cross_dual(const Motion<A>& v, const Force<B>& f) {
  return {cross(v.ang, f.lin), cross(v.ang, f.ang) + cross(v.lin, f.lin)};
}

/// X = [R, -R r~; 0, R]: R turns parent components into child components, r is the child's origin
/// in the parent frame.
template <class S>
struct Transform {
  Mat3<S> R;
  Vec3<S> r;
};

/// X v: motion of the parent frame, seen at the child frame.
template <class A, class B>
LW_INLINE Motion<Wider<A, B>> operator*(const Transform<A>& X, const Motion<B>& v) {
  return {X.R * (v.lin + cross(v.ang, X.r)), X.R * v.ang};
}
/// X^T f: force on the child frame, seen at the parent frame.
template <class A, class B>
LW_INLINE Force<Wider<A, B>> transpose_times(const Transform<A>& X, const Force<B>& f) {
  const auto lin = transpose_times(X.R, f.lin);
  return {lin, transpose_times(X.R, f.ang) + cross(X.r, lin)};
}
/// X^-T f: force on the parent frame, seen at the child frame.
template <class A, class B>
LW_INLINE Force<Wider<A, B>> inverse_transpose_times(const Transform<A>& X, const Force<B>& f) {
  return {X.R * f.lin, X.R * (f.ang - cross(X.r, f.lin))};
}
/// X^-1 v: motion of the child frame, seen at the parent frame.
template <class A, class B>
LW_INLINE Motion<Wider<A, B>> inverse_times(const Transform<A>& X, const Motion<B>& v) {
  const auto ang = transpose_times(X.R, v.ang);
  return {transpose_times(X.R, v.lin) + cross(X.r, ang), ang};
}
/// X_CA = X_CB X_BA.
template <class A, class B>
LW_INLINE Transform<Wider<A, B>> operator*(const Transform<A>& X_CB, const Transform<B>& X_BA) {
  return {X_CB.R * X_BA.R, X_BA.r + transpose_times(X_BA.R, X_CB.r)};
}

}  // namespace linkwise
