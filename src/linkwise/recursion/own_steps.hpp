#pragma once
// Eliminates the coordinates of a body's own: with what joints on its port add,
//     m_e du = tau - p_e - M_e^T a,
//     Y = M - M_e m_e^-1 M_e^T,  p = p + M_e m_e^-1 (tau - p_e),
// after which the joint inboard sees an ordinary body. Formulas: docs/theory/flexible.md.
#include "linkwise/base/tolerances.hpp"
#include "linkwise/bodies/own_coordinates.hpp"
#include "linkwise/simd/cholesky.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

/// Adds the inertia Y of what hangs on a port, and the wrench p that it takes where the port has no
/// acceleration but the one that rates give it.
template <class S>
LW_INLINE void add_to_own(int n, const ElasticPort<S>& port, const Transform<S>& X,
                          const ArticulatedInertia<S>& Y, const Force<S>& p, OwnEquations<S>& to) {
  for (int k = 0; k < n; ++k) {
    const Force<S> U = Y * port.P[k];
    to.M_e[k] += transpose_times(X, U);
    for (int l = 0; l <= k; ++l) to.m_e[packed(k, l)] += dot(port.P[l], U);
    to.p_e[k] += dot(port.P[k], p);
  }
}

/// The factor of m_e in its place, and Y and p without the coordinates. False where m_e is not
/// positive definite. h [n]: tau - p_e.
template <class S>
LW_INLINE bool eliminate_own(int n, OwnEquations<S>& of, const S* tau, S* h,
                             ArticulatedInertia<S>& Y, Force<S>& p) {
  const bool positive = cholesky_factor(n, of.m_e, smallest_pivot);
  PerCoordinate<Force<S>> W;
  S z[most_coordinates];
  for (int i = 0; i < n; ++i) {
    Force<S> column = of.M_e[i];
    h[i] = (tau ? tau[i] : S{}) - of.p_e[i];
    S y = h[i];
    for (int l = 0; l < i; ++l) {
      column -= of.m_e[packed(i, l)] * W[l];
      y = y - of.m_e[packed(i, l)] * z[l];
    }
    const S r = of.m_e[packed(i, i)];
    W[i] = r * column;
    z[i] = r * y;
    subtract_outer(Y, W[i], W[i]);
    p += z[i] * W[i];
  }
  return positive;
}

/// h and p for another right-hand side.
template <class S>
LW_INLINE void respond_own(int n, const OwnEquations<S>& of, const S* p_e, const S* tau, S* h,
                           Force<S>& p) {
  S y[most_coordinates];
  for (int i = 0; i < n; ++i) y[i] = h[i] = (tau ? tau[i] : S{}) - p_e[i];
  cholesky_solve(n, of.m_e, y);
  for (int i = 0; i < n; ++i) p += y[i] * of.M_e[i];
}

/// du from the acceleration of the body's frame.
template <class S>
LW_INLINE void accelerate_own(int n, const OwnEquations<S>& of, const S* h, const Motion<S>& a,
                              S* du) {
  for (int i = 0; i < n; ++i) du[i] = h[i] - dot(a, of.M_e[i]);
  cholesky_solve(n, of.m_e, du);
}

}  // namespace linkwise
