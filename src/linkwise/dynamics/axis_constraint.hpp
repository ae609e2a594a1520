#pragma once
// What a joint of one axis transmits, as six numbers f: the first five do no work, and the motion
// subspace P is dual to the last, which is the drive's. In terms of forces and moments,
//     about z:   fx  fy  fz             nx  ny  nz
//     along z:   fx  fy  nz             nx  ny  fz
//     screw:     fx  fy  fz - pitch nz  nx  ny  nz
// are the columns of the basis E. The joint's own motion maps the span of the first five to itself,
// so that they may be taken in the frame before the motion. An armature I adds P P^T / I to the
// compliance, which in this basis is 1/I in the last place.
#include "linkwise/dynamics/joint_elimination.hpp"
#include "linkwise/kinematics/placement.hpp"
#include "linkwise/recursion/steps.hpp"

namespace linkwise {

/// E^T m.
template <class J, class T>
LW_INLINE void to_components(const Motion<T>& m, double pitch, T* out) {
  constexpr bool slide = !J::turns;
  out[0] = m.lin.x;
  out[1] = m.lin.y;
  out[2] = slide ? m.ang.z : m.lin.z;
  out[3] = m.ang.x;
  out[4] = m.ang.y;
  out[5] = slide ? m.lin.z : m.ang.z;
  if constexpr (J::turns && J::slides) out[2] = out[2] - pitch * out[5];
}

/// E f.
template <class J, class S>
LW_INLINE Force<S> to_wrench(const S* f, const S& last, double pitch) {
  if constexpr (!J::turns) return {{f[0], f[1], last}, {f[3], f[4], f[2]}};
  if constexpr (J::slides) return {{f[0], f[1], f[2]}, {f[3], f[4], last - pitch * f[2]}};
  return {{f[0], f[1], f[2]}, {f[3], f[4], last}};
}

/// The last component of a motion: P^+ m of one along the joint's own.
template <class J, class S>
LW_INLINE const S& rate_of(const Motion<S>& m) {
  return J::turns ? m.ang.z : m.lin.z;
}

/// Rows of E^T Phi E, lower triangle by rows.
template <class J, int rows, class S>
LW_INLINE void to_components(const Compliance<S>& Phi, double pitch, S* D) {
  constexpr int place[6] = {0, 1, J::turns ? 2 : 5, 3, 4, J::turns ? 5 : 2};
#pragma GCC unroll 6
  for (int i = 0; i < rows; ++i)
#pragma GCC unroll 6
    for (int j = 0; j <= i; ++j) D[packed(i, j)] = entry(Phi, place[i], place[j]);
  if constexpr (J::turns && J::slides) {
    D[packed(2, 2)] = D[packed(2, 2)] + pitch * (pitch * entry(Phi, 5, 5) - 2.0 * entry(Phi, 5, 2));
#pragma GCC unroll 6
    for (int i = 0; i < rows; ++i)
      if (i != 2) D[packed(i, 2)] = D[packed(i, 2)] - pitch * entry(Phi, 5, i);
  }
}

/// E^T X Phi' and E^T X Phi' X^T E from the frame before the joint's motion.
template <class J, class T>
void calc_across(const BodyConstants<double>& k, const Compliance<T>& Phi, Across<T>& out) {
  T columns[6][6];
  for (int j = 0; j < 6; ++j)
    to_components<J>(before_motion<J>(k, column(Phi, j)), k.pitch, columns[j]);
  for (int i = 0; i < 6; ++i) {
    T row[6], W[6];
    for (int j = 0; j < 6; ++j) row[j] = columns[j][i];
    const Motion<T> K = to_motion(row);
    std::copy(row, row + 6, out.K[i]);
    to_components<J>(before_motion<J>(k, K), k.pitch, W);
    for (int j = 0; j <= i; ++j) out.W[packed(i, j)] = W[j];
  }
}

}  // namespace linkwise
