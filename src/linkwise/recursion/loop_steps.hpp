#pragma once
// What unit forces at joints that close loops do to a body on the way inward. A unit force is a
// wrench F on the body. The body's joint, eliminated, yields to the part z = P^T F, and the parent
// feels the rest:
//     y = D^-1 z,  Fbar = F - U y,  F_p += X^T Fbar
// A row that reads F^T a of the bodies that it acts on thereby becomes
//     F^T a_n = Fbar^T X a_p + beta + Lambda f,   Lambda = z^T y,   beta = y^T h + Fbar^T c
// These are the columns of cut forces in steps.hpp, for any joint and number of rows.
#include "linkwise/recursion/own_steps.hpp"
#include "linkwise/recursion/stack_steps.hpp"

namespace linkwise {

/// A unit force of a loop joint at one body. A coupling has no wrench: its unit force is a torque
/// in each of the joints that it ties, which z is before the column is carried.
template <class S>
struct LoopColumn {
  Force<S> F;          ///< on the body; once carried: what its joint transmits, in the body's frame
  Force<S> at_parent;  ///< once carried: the same as seen by the parent
  S z[6], y[6];        ///< by the columns of the joint
  S beta;
};

// A column may be several, in the lanes of T.

/// Each returns the number of columns z.
template <class J, class S, class T>
LW_INLINE int carry(const EliminatedAxis<S>& axis, const Motion<S>& c, double pitch,
                    LoopColumn<T>& column) {
  column.z[0] += J::project(column.F, pitch);
  const T y = column.z[0] * axis.D_inverse;
  column.y[0] = y;
  column.F -= y * axis.U;
  column.beta = y * axis.h + dot(c, column.F);
  return 1;
}

template <class S, class T>
LW_INLINE int carry(const GeneralState<S>& joint, const EliminatedStack<S>& stack,
                    const Motion<S>& c, LoopColumn<T>& column) {
  T L[21];
  for (int i = 0; i < packed(joint.n, 0); ++i) L[i] = T{} + stack.L[i];
  for (int k = 0; k < joint.n; ++k) {
    column.z[k] += dot(joint.P[k], column.F);
    column.y[k] = column.z[k];
  }
  cholesky_solve(joint.n, L, column.y);
  column.beta = T{};
  for (int k = 0; k < joint.n; ++k) {
    const T y = column.y[k];
    column.F -= y * stack.U[k];
    column.beta += y * stack.h[k];
  }
  column.beta += dot(c, column.F);
  return joint.n;
}

/// A floating joint transmits nothing.
template <class S, class T>
int carry(const EliminatedFree<S>& free, LoopColumn<T>& column) {
  T L[21];
  for (int i = 0; i < 21; ++i) L[i] = T{} + free.L[i];
  const Vector6<T> z = to_array(column.F), y = to_array(solve(L, column.F));
  for (int k = 0; k < 6; ++k) {
    column.z[k] = z[k];
    column.y[k] = y[k];
  }
  column.beta = dot(free.a, column.F);
  column.F = {};
  return 6;
}

/// Coordinates of a body's own yield to the part z of a unit force that is along them, [n], before
/// the body's joint does: y = m_e^-1 z, and the frame feels F - M_e y. Returns what that adds to
/// beta.
template <class S>
LW_INLINE S carry_own(int n, const OwnEquations<S>& of, const S* h, const S* z, S* y, Force<S>& F) {
  for (int k = 0; k < n; ++k) y[k] = z[k];
  cholesky_solve(n, of.m_e, y);
  S beta{};
  for (int k = 0; k < n; ++k) {
    F -= y[k] * of.M_e[k];
    beta += y[k] * h[k];
  }
  return beta;
}

/// The joint under forces of which z and y add up to these, by the columns of the joint.
template <class S>
LW_INLINE void apply(const S* z, const S*, int, EliminatedAxis<S>& axis) {
  axis.h += z[0];
}
template <class S>
LW_INLINE void apply(const S* z, const S*, int n, EliminatedStack<S>& stack) {
  for (int k = 0; k < n; ++k) stack.h[k] += z[k];
}
template <class S>
LW_INLINE void apply(const S*, const S* y, int, EliminatedFree<S>& free) {
  free.a += to_motion(y);
}

/// The joint under the force f.
template <class S>
LW_INLINE void apply(const LoopColumn<S>& column, const S& f, EliminatedAxis<S>& axis) {
  axis.h += f * column.z[0];
}
template <class S>
LW_INLINE void apply(const LoopColumn<S>& column, const S& f, int n, EliminatedStack<S>& stack) {
  for (int k = 0; k < n; ++k) stack.h[k] += f * column.z[k];
}
template <class S>
LW_INLINE void apply(const LoopColumn<S>& column, const S& f, EliminatedFree<S>& free) {
  const Motion<S> y = to_motion(column.y);
  free.a += f * y;
}

}  // namespace linkwise
