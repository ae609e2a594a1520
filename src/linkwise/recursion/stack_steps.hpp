#pragma once
// The steps of steps.hpp for joints of several axes or none, the stacks of elements: U and P are up
// to six columns and D is a matrix, kept as its Cholesky factor. A floating joint without rotors
// has P = 1; its steps are last.
#include "linkwise/base/tolerances.hpp"
#include "linkwise/kinematics/body_state.hpp"
#include "linkwise/recursion/steps.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

/// One column P of a stack, for the steps of one axis.
struct ColumnJoint {
  static constexpr bool leaves_zero_row = false;
  template <class S>
  LW_INLINE static Force<S> column(const ArticulatedInertia<S>& Y, const Motion<S>& P) {
    return Y * P;
  }
  template <class S>
  LW_INLINE static S project(const Force<S>& f, const Motion<S>& P) {
    return dot(P, f);
  }
};

/// A joint of several axes, eliminated.
template <class S>
struct EliminatedStack {
  Force<S> U[6];  ///< Y P
  S L[21];        ///< Cholesky factor of D
  S h[6];         ///< tau - P^T p
};

/// U, D and h, as of one axis. tau and armature are those of all joints. False where D is not
/// positive definite.
template <class S>
LW_INLINE bool eliminate(const GeneralState<S>& joint, const ArticulatedInertia<S>& Y,
                         const Force<S>& p, const double* armature, const S* tau,
                         EliminatedStack<S>& out) {
  for (int i = 0; i < joint.n; ++i) out.U[i] = Y * joint.P[i];
  for (int i = 0; i < joint.n; ++i) {
    for (int j = 0; j <= i; ++j) out.L[packed(i, j)] = dot(joint.P[i], out.U[j]);
    S& d = out.L[packed(i, i)];
    d = d + armature[joint.dof[i]];
    out.h[i] = tau[joint.dof[i]] - dot(joint.P[i], p);
  }
  return cholesky_factor(joint.n, out.L, smallest_pivot);
}

/// Ya and pa in the places of Y and p.
template <class S>
LW_INLINE void reduce(int n_columns, const EliminatedStack<S>& stack, const Motion<S>& c,
                      ArticulatedInertia<S>& Y, Force<S>& p) {
  // W = U L^-T, so that U D^-1 U^T = W W^T and U D^-1 h = W (L^-1 h).
  Force<S> W[6];
  S z[6];
  for (int i = 0; i < n_columns; ++i) {
    Force<S> column = stack.U[i];
    S y = stack.h[i];
    for (int l = 0; l < i; ++l) {
      column -= stack.L[packed(i, l)] * W[l];
      y = y - stack.L[packed(i, l)] * z[l];
    }
    const S r = stack.L[packed(i, i)];
    W[i] = r * column;
    z[i] = r * y;
    subtract_outer(Y, W[i], W[i]);
  }
  p += Y * c;
  for (int i = 0; i < n_columns; ++i) p += z[i] * W[i];
}

/// h and pa, in the place of p, for another right-hand side.
template <class S>
LW_INLINE void respond(const GeneralState<S>& joint, const ArticulatedInertia<S>& Ya,
                       const Motion<S>& c, const S* tau, EliminatedStack<S>& stack, Force<S>& p) {
  S y[6];
  for (int i = 0; i < joint.n; ++i) y[i] = stack.h[i] = tau[joint.dof[i]] - dot(joint.P[i], p);
  cholesky_solve(joint.n, stack.L, y);
  p += Ya * c;
  for (int i = 0; i < joint.n; ++i) p += y[i] * stack.U[i];
}

/// a += P du. du: those of all joints.
template <class S>
LW_INLINE void add_rates(const GeneralState<S>& joint, const S* du, Motion<S>& a) {
  for (int i = 0; i < joint.n; ++i) {
    const S rate = du[joint.dof[i]];
    a += rate * joint.P[i];
  }
}

/// tau = P^T w of all elements of a stack, prescribed ones too; w: the load at the body.
template <class S>
void project_on_elements(const Model& model, const BodyTopology& body, const S* q, Force<S> w,
                         S* tau) {
  for (int i = body.n_elements - 1; i >= 0; --i) {
    const Element& e = model.elements[body.first_element + i];
    if (e.kind == ElementKind::elastic)  // beside what the body takes itself
      for_columns(e, q, [&](int k, const Motion<S>& column) { tau[e.v + k] += dot(column, w); });
    else
      for (int k = 0; k < e.nv; ++k) tau[e.v + k] = dot(element_column<S>(e, k), w);
    if (i > 0) w = transpose_times(element_pose(e, q), w);
  }
}

/// The joint's accelerations into du; a = X a_p becomes the body's own.
template <class S>
LW_INLINE void accelerate(const GeneralState<S>& joint, const EliminatedStack<S>& stack,
                          const Motion<S>& c, Motion<S>& a, S* du) {
  a += c;
  S y[6];
  for (int i = 0; i < joint.n; ++i) y[i] = stack.h[i] - dot(a, stack.U[i]);
  cholesky_solve(joint.n, stack.L, y);
  for (int i = 0; i < joint.n; ++i) du[joint.dof[i]] = y[i];
  add_rates(joint, du, a);
}

/// A floating joint without rotors: D = Y, and the parent feels nothing but the joint's own forces.
template <class S>
struct EliminatedFree {
  S L[21];      ///< Cholesky factor of Y
  Motion<S> a;  ///< acceleration of the body, Y^-1 (tau - p)
};

template <class S>
LW_INLINE void respond(const Force<S>& p, const Force<S>& tau, EliminatedFree<S>& out) {
  Force<S> f = tau;
  f -= p;
  out.a = solve(out.L, f);
}

/// False where Y is not positive definite.
template <class S>
LW_INLINE bool eliminate(const ArticulatedInertia<S>& Y, const Force<S>& p, const Force<S>& tau,
                         EliminatedFree<S>& out) {
  const bool positive = factor(Y, out.L, smallest_pivot);
  respond(p, tau, out);
  return positive;
}

/// The joint's six accelerations into du; a = X a_p becomes the body's own.
template <class S>
LW_INLINE void accelerate(const EliminatedFree<S>& free, const Motion<S>& c, Motion<S>& a, S* du) {
  a += c;
  const Vector6<S> carried = to_array(a), whole = to_array(free.a);
  for (int i = 0; i < 6; ++i) du[i] = whole[i] - carried[i];
  a = free.a;
}

}  // namespace linkwise
