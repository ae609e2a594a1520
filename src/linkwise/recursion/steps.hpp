#pragma once
// The articulated-body recursion, one body at a time [featherstone1983; featherstone2008, ch. 7]:
//     Y_n = M_n + sum X_k^T Ya_k X_k,  U = Y P,  D = P^T U + armature,  h = tau - P^T p
//     Ya = Y - U D^-1 U^T,  pa = p + Ya c + U D^-1 h;   du = D^-1 (h - U^T (X a_p + c))
// for joints of one axis; stack_steps.hpp has the others. This file says what is computed and
// nothing about the order, which is the schedule's. The functions take and return plain values of
// any scalar S and have no memory of their own, so every schedule and every kind of processor can
// share them.
//
// Ours differs from the book in the joint axis along z, which makes U a column and D a number, and
// in the zeros that eliminating a hinge leaves (hinge.hpp).
#include <type_traits>

#include "linkwise/bodies/rigid.hpp"
#include "linkwise/joints/axis_joints.hpp"
#include "linkwise/simd/lanes.hpp"
#include "linkwise/spatial/hinge.hpp"

namespace linkwise {

/// What a body contributes to its parent: it takes the wrench Y a + p from a parent with the
/// acceleration a.
template <class S>
struct Contribution {
  ArticulatedInertia<S> Y;
  Force<S> p;
};

template <class S>
LW_INLINE void operator+=(Contribution<S>& a, const Contribution<S>& b) {
  a.Y += b.Y;
  a.p += b.p;
}

/// A joint of one axis, eliminated. U and D depend on the position alone.
template <class S>
struct EliminatedAxis {
  Force<S> U;      ///< Y P
  S D_inverse, h;  ///< 1 / (P^T Y P + armature), tau - P^T p
};

/// Ya: a joint without rotor leaves an inertia that is zero about z.
template <class J, class S>
using ReducedInertia =
    std::conditional_t<J::leaves_zero_row, PlanarInertia<S>, ArticulatedInertia<S>>;

/// to = Y, entry by entry, for the reason given at store() of a wrench.
template <class S>
LW_INLINE void store(PlanarInertia<S>& to, const PlanarInertia<S>& Y) {
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) {
    to.A.m[i] = Y.A.m[i];
    to.B[i] = Y.B[i];
  }
  to.xx = Y.xx;
  to.xy = Y.xy;
  to.yy = Y.yy;
}
template <class S>
LW_INLINE void store(ArticulatedInertia<S>& to, const ArticulatedInertia<S>& Y) {
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) {
    to.A.m[i] = Y.A.m[i];
    to.C.m[i] = Y.C.m[i];
  }
#pragma GCC unroll 9
  for (int i = 0; i < 9; ++i) to.B.m[i] = Y.B.m[i];
}

/// Stands for the armature of a joint that has none.
struct NoRotor {};

/// v_n = X v_p + P u.
template <class J, class Place, class S>
LW_INLINE Motion<S> outward_velocity(const Place& place, const Motion<S>& v_parent, double pitch,
                                     const S& rate) {
  Motion<S> v = place.to_child(v_parent);
  J::add_rate(v, pitch, rate);
  return v;
}

/// U, D and h of a joint whose outboard side takes Y a + p. Returns D, which must be positive.
/// along: the pitch, or the column of a ColumnJoint.
template <class J, class S, class Along, class Rotor>
LW_INLINE S eliminate(const ArticulatedInertia<S>& Y, const Force<S>& p, const Along& along,
                      const Rotor& rotor, const S& tau, EliminatedAxis<S>& out) {
  out.U = J::column(Y, along);
  S D = J::project(out.U, along);
  if constexpr (!std::is_same_v<Rotor, NoRotor>) D = D + rotor;
  out.D_inverse = 1.0 / D;
  out.h = tau - J::project(p, along);
  return D;
}

/// Ya in the place of Y; returns U / D.
template <class S>
LW_INLINE Force<S> reduce_inertia(const EliminatedAxis<S>& axis, ArticulatedInertia<S>& Y) {
  const Force<S> V = axis.D_inverse * axis.U;
  subtract_outer(Y, V, axis.U);
  return V;
}

/// Ya, and pa in the place of p.
template <class J, class S>
LW_INLINE void reduce(const ArticulatedInertia<S>& Y, const EliminatedAxis<S>& axis,
                      const Motion<S>& c, ReducedInertia<J, S>& Ya, Force<S>& p) {
  if constexpr (J::leaves_zero_row) {
    const Force<S> V = axis.D_inverse * axis.U;
    eliminate_turn(Y, axis.U, V, c, axis.h, Ya, p);
  } else {
    Ya = Y;
    const Force<S> V = reduce_inertia(axis, Ya);
    p += Ya * c;
    p += axis.h * V;
  }
}

/// h and pa, in the place of p, for another right-hand side at the same position. Y, U and D stand
/// for the factors L D L^T of the joint-space mass matrix [rodriguez1987].
template <class J, bool moving, class S>
LW_INLINE void respond(const ReducedInertia<J, S>& Ya, const Motion<S>& c, double pitch,
                       const S& tau, EliminatedAxis<S>& axis, Force<S>& p) {
  const S h = tau - J::project(p, pitch);
  axis.h = h;
  if constexpr (moving) p += Ya * c;
  const S rate = axis.D_inverse * h;
  p += rate * axis.U;
}

/// The joint load w = Ya X a_p + pa from the parent's acceleration a = X a_p, seen at the body.
template <class Inertia, class S>
LW_INLINE Force<S> outward_load(const Inertia& Ya, const Force<S>& pa, const Motion<S>& a) {
  Force<S> w = Ya * a;
  w += pa;
  return w;
}

/// Leaves a joint's torque as it is.
struct NoCut {
  template <class S>
  LW_INLINE S less(const S& h) const {
    return h;
  }
};

/// Returns du; a = X a_p becomes the body's own acceleration. `cut` takes from the torque what
/// forces at cuts farther out demand of the joint.
template <class J, class S, class Cut = NoCut>
LW_INLINE S accelerate(const EliminatedAxis<S>& axis, const Motion<S>& c, double pitch,
                       Motion<S>& a, const Cut& cut = {}) {
  a += c;
  const S rate = axis.D_inverse * cut.less(S(axis.h - dot(a, axis.U)));
  J::add_rate(a, pitch, rate);
  return rate;
}

/// Constrained directions of a revolute joint, which is where chains are cut.
inline constexpr int cut_rows = 5;

/// What unit forces at the outboard cut do to bodies inboard; the elimination carries it along.
/// rows: those of the cut joint, or six where joints that close loops push there too.
template <class S, int rows = cut_rows>
struct CutForces {
  Force<S> Psi[rows];               ///< on the body at hand
  S Lambda[rows * (rows + 1) / 2];  ///< at the cut itself, lower triangle by rows
  S beta[rows];                     ///< what the known forces do at the cut
};

/// Across a hinge: row = P^T Psi of the joint, Psi as seen by the parent.
template <class Place, class S, int rows>
LW_INLINE void carry_cut_forces(const Place& place, const EliminatedAxis<S>& axis,
                                const Motion<S>& c, CutForces<S, rows>& cut, S* row) {
  for (int i = 0; i < rows; ++i) {
    const S r = cut.Psi[i].ang.z, scaled = r * axis.D_inverse;
    row[i] = r;
    for (int j = 0; j <= i; ++j) cut.Lambda[packed(i, j)] += scaled * cut.Psi[j].ang.z;
    cut.beta[i] += scaled * axis.h;
  }
  const Force<S> V = axis.D_inverse * axis.U;
#pragma GCC unroll 6
  for (int i = 0; i < rows; ++i) {
    Force<S>& Psi = cut.Psi[i];
    const S r = Psi.ang.z;
    Psi -= r * V;
    cut.beta[i] +=
        Psi.lin.x * c.lin.x + Psi.lin.y * c.lin.y + Psi.ang.x * c.ang.x + Psi.ang.y * c.ang.y;
    Psi = place.to_parent(Psi);
  }
}

/// For accelerate(): the torque less what the forces f at the outboard cut demand of the joint.
template <class S, int rows = cut_rows>
struct CutTorque {
  const S *row, *f;
  LW_INLINE S less(S h) const {
    for (int j = 0; j < rows; ++j) h = h - row[j] * f[j];
    return h;
  }
};

/// The load of a body's inboard joint by Newton and Euler. w holds the loads of its outboard
/// joints, seen at the body, and the body's own share is added to it.
template <class Body, class S>
LW_INLINE void inward_load(const Body& body, const Motion<S>& a, const Force<S>& bias,
                           Force<S>& w) {
  w += inertia_times(body, a);
  w += bias;
}

}  // namespace linkwise
