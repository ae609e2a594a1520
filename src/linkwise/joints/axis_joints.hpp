#pragma once
// The joints of one degree of freedom about or along z, as stateless structs: everything a sweep
// needs of them is a selection or a scaling of single components. P is the motion subspace.
#include "linkwise/simd/sincos.hpp"
#include "linkwise/spatial/inertia.hpp"

namespace linkwise {

/// X = Rz(q)^T X_tree without multiplying out the zeros.
template <class S, class C>
LW_INLINE Mat3<S> turn_about_z(const Mat3<C>& R, S cosine, S sine) {
  Mat3<S> out;
#pragma GCC unroll 3
  for (int j = 0; j < 3; ++j) {
    out.m[j] = cosine * R.m[j] + sine * R.m[3 + j];
    out.m[3 + j] = cosine * R.m[3 + j] - sine * R.m[j];
    out.m[6 + j] = R.m[6 + j] + S{};
  }
  return out;
}

struct RevoluteJoint {
  /// What the joint does to its frame: turn about z, slide along z.
  static constexpr bool turns = true, slides = false;
  /// Eliminating the joint leaves an inertia that is zero about z: PlanarInertia.
  static constexpr bool leaves_zero_row = true;
  /// The placement is that of Denavit and Hartenberg.
  static constexpr bool is_hinge = false;

  template <class S, class C>
  LW_INLINE static Transform<S> pose(const Transform<C>& tree, C, S q) {
    S c, s;
    sincos(q, s, c);
    return {turn_about_z(tree.R, c, s), {tree.r.x + S{}, tree.r.y + S{}, tree.r.z + S{}}};
  }
  template <class S, class C>
  LW_INLINE static void add_rate(Motion<S>& v, C, S u) {
    v.ang.z += u;
  }
  /// v x P u.
  template <class S, class C>
  LW_INLINE static Motion<S> bias(const Motion<S>& v, C, S u) {
    return {{v.lin.y * u, -v.lin.x * u, S{}}, {v.ang.y * u, -v.ang.x * u, S{}}};
  }
  /// P^T f.
  template <class S, class C>
  LW_INLINE static S project(const Force<S>& f, C) {
    return f.ang.z;
  }
  /// Y P.
  template <class S, class C>
  LW_INLINE static Force<S> column(const ArticulatedInertia<S>& Y, C) {
    return {{Y.B.m[2], Y.B.m[5], Y.B.m[8]}, {Y.C.m[3], Y.C.m[4], Y.C.m[5]}};
  }
};

/// Revolute with the placement of a hinge.
struct HingeJoint : RevoluteJoint {
  static constexpr bool is_hinge = true;
};

/// Revolute with a rotor: its inertia about z remains.
struct GearedJoint : RevoluteJoint {
  static constexpr bool leaves_zero_row = false;
};

struct PrismaticJoint {
  static constexpr bool turns = false, slides = true;
  static constexpr bool leaves_zero_row = false, is_hinge = false;

  template <class S, class C>
  LW_INLINE static Transform<S> pose(const Transform<C>& tree, C, S q) {
    Transform<S> X;
#pragma GCC unroll 9
    for (int i = 0; i < 9; ++i) X.R.m[i] = tree.R.m[i] + S{};
    X.r = {tree.r.x + tree.R.m[6] * q, tree.r.y + tree.R.m[7] * q, tree.r.z + tree.R.m[8] * q};
    return X;
  }
  template <class S, class C>
  LW_INLINE static void add_rate(Motion<S>& v, C, S u) {
    v.lin.z += u;
  }
  template <class S, class C>
  LW_INLINE static Motion<S> bias(const Motion<S>& v, C, S u) {
    return {{v.ang.y * u, -v.ang.x * u, S{}}, {}};
  }
  template <class S, class C>
  LW_INLINE static S project(const Force<S>& f, C) {
    return f.lin.z;
  }
  template <class S, class C>
  LW_INLINE static Force<S> column(const ArticulatedInertia<S>& Y, C) {
    return {{Y.A.m[3], Y.A.m[4], Y.A.m[5]}, {Y.B.m[6], Y.B.m[7], Y.B.m[8]}};
  }
};

/// A screw: P = (0, 0, pitch, 0, 0, 1).
struct HelicalJoint {
  static constexpr bool turns = true, slides = true;
  static constexpr bool leaves_zero_row = false, is_hinge = false;

  template <class S, class C>
  LW_INLINE static Transform<S> pose(const Transform<C>& tree, C pitch, S q) {
    S c, s;
    sincos(q, s, c);
    const S d = pitch * q;
    return {turn_about_z(tree.R, c, s),
            {tree.r.x + tree.R.m[6] * d, tree.r.y + tree.R.m[7] * d, tree.r.z + tree.R.m[8] * d}};
  }
  template <class S, class C>
  LW_INLINE static void add_rate(Motion<S>& v, C pitch, S u) {
    v.lin.z += pitch * u;
    v.ang.z += u;
  }
  template <class S, class C>
  LW_INLINE static Motion<S> bias(const Motion<S>& v, C pitch, S u) {
    Motion<S> c = RevoluteJoint::bias(v, pitch, u);
    c += PrismaticJoint::bias(v, pitch, S(pitch * u));
    return c;
  }
  template <class S, class C>
  LW_INLINE static S project(const Force<S>& f, C pitch) {
    return f.ang.z + pitch * f.lin.z;
  }
  template <class S, class C>
  LW_INLINE static Force<S> column(const ArticulatedInertia<S>& Y, C pitch) {
    Force<S> u = RevoluteJoint::column(Y, pitch);
    const Force<S> along = PrismaticJoint::column(Y, pitch);
    u += pitch * along;
    return u;
  }
};

}  // namespace linkwise
