#pragma once
// Motions, forces and inertias across a hinge, whose placement is that of [denavit1955]:
//     parent -- turn about x by alpha, go a along x -- go d along z, turn about z -- child.
// Everything is a planar rotation or a shift along one axis. Inertias keep the zeros that
// eliminating the joint leaves until the shift along x fills them.
#include "linkwise/spatial/inertia.hpp"

namespace linkwise {

/// The articulated inertia of a revolute joint without rotor after its elimination: the row and
/// column of the rotation about z are zero.
template <class S>
struct PlanarInertia {
  Sym3<S> A;
  S B[6];        ///< 3x2, row-major: the third column is zero
  S xx, xy, yy;  ///< of C
};

/// The four numbers of a placement and the cosine and sine of its joint.
template <class C>
struct HingePlacement {
  C cos_alpha, sin_alpha, a, d;
};

/// (x, y) turned by the angle with this cosine and sine.
template <class A, class B>
LW_INLINE void turn(const A& c, const A& s, B& x, B& y) {
  const B turned = c * x - s * y;
  y = s * x + c * y;
  x = turned;
}

/// A 2x2 block turned from both sides. It is written out because the shorter form, which adds c t
/// and s t to the entries, cancels digits of the small entry if inertias along and across differ by
/// orders of magnitude.
template <class A, class B>
LW_INLINE void turn_block(const A& c, const A& s, B& xx, B& xy, B& yx, B& yy) {
  turn(c, s, xx, yx);
  turn(c, s, xy, yy);
  turn(c, s, xx, xy);
  turn(c, s, yx, yy);
}
template <class A, class B>
LW_INLINE void turn_block(const A& c, const A& s, B& xx, B& xy, B& yy) {
  const B p = c * xx - s * xy, q = c * xy - s * yy;
  const B r = s * xx + c * xy, u = s * xy + c * yy;
  xx = c * p - s * q;
  xy = s * p + c * q;
  yy = s * r + c * u;
}

/// X v but for the turn about z.
template <class C, class S>
LW_INLINE Motion<S> to_child(const HingePlacement<C>& k, Motion<S> v) {
  turn(k.cos_alpha, -k.sin_alpha, v.lin.y, v.lin.z);
  turn(k.cos_alpha, -k.sin_alpha, v.ang.y, v.ang.z);
  v.lin.x += k.d * v.ang.y;
  v.lin.y += k.a * v.ang.z - k.d * v.ang.x;
  v.lin.z -= k.a * v.ang.y;
  return v;
}

/// X v.
template <class C, class S>
LW_INLINE Motion<S> to_child(const HingePlacement<C>& k, S c, S s, const Motion<S>& v) {
  Motion<S> out = to_child(k, v);
  turn(c, -s, out.lin.x, out.lin.y);
  turn(c, -s, out.ang.x, out.ang.y);
  return out;
}

/// X^T f but for the turn about z.
template <class C, class S>
LW_INLINE Force<S> to_parent(const HingePlacement<C>& k, Force<S> f) {
  f.ang.x -= k.d * f.lin.y;
  f.ang.y += k.d * f.lin.x - k.a * f.lin.z;
  f.ang.z += k.a * f.lin.y;
  turn(k.cos_alpha, k.sin_alpha, f.lin.y, f.lin.z);
  turn(k.cos_alpha, k.sin_alpha, f.ang.y, f.ang.z);
  return f;
}

/// X^T f.
template <class C, class S>
LW_INLINE Force<S> to_parent(const HingePlacement<C>& k, S c, S s, Force<S> f) {
  turn(c, s, f.lin.x, f.lin.y);
  turn(c, s, f.ang.x, f.ang.y);
  return to_parent(k, f);
}

/// Eliminates a revolute joint without rotor, with U = Y P, V = U / D: Z = Y - V U^T and
/// p + Z c + V h. c has no z components, and the moment about z that is left is the joint's torque.
template <class S>
LW_INLINE void eliminate_turn(const ArticulatedInertia<S>& Y, const Force<S>& U, const Force<S>& V,
                              const Motion<S>& c, S h, PlanarInertia<S>& Z, Force<S>& p) {
  Z.A = Y.A;
  Z.A.m[0] -= V.lin.x * U.lin.x;
  Z.A.m[1] -= V.lin.y * U.lin.x;
  Z.A.m[2] -= V.lin.y * U.lin.y;
  Z.A.m[3] -= V.lin.z * U.lin.x;
  Z.A.m[4] -= V.lin.z * U.lin.y;
  Z.A.m[5] -= V.lin.z * U.lin.z;
  Z.B[0] = Y.B.m[0] - V.lin.x * U.ang.x;
  Z.B[1] = Y.B.m[1] - V.lin.x * U.ang.y;
  Z.B[2] = Y.B.m[3] - V.lin.y * U.ang.x;
  Z.B[3] = Y.B.m[4] - V.lin.y * U.ang.y;
  Z.B[4] = Y.B.m[6] - V.lin.z * U.ang.x;
  Z.B[5] = Y.B.m[7] - V.lin.z * U.ang.y;
  Z.xx = Y.C.m[0] - V.ang.x * U.ang.x;
  Z.xy = Y.C.m[1] - V.ang.y * U.ang.x;
  Z.yy = Y.C.m[2] - V.ang.y * U.ang.y;
  const auto& A = Z.A.m;
  p.lin.x += A[0] * c.lin.x + A[1] * c.lin.y + Z.B[0] * c.ang.x + Z.B[1] * c.ang.y + V.lin.x * h;
  p.lin.y += A[1] * c.lin.x + A[2] * c.lin.y + Z.B[2] * c.ang.x + Z.B[3] * c.ang.y + V.lin.y * h;
  p.lin.z += A[3] * c.lin.x + A[4] * c.lin.y + Z.B[4] * c.ang.x + Z.B[5] * c.ang.y + V.lin.z * h;
  p.ang.x += Z.B[0] * c.lin.x + Z.B[2] * c.lin.y + Z.xx * c.ang.x + Z.xy * c.ang.y + V.ang.x * h;
  p.ang.y += Z.B[1] * c.lin.x + Z.B[3] * c.lin.y + Z.xy * c.ang.x + Z.yy * c.ang.y + V.ang.y * h;
  p.ang.z += h;
}

/// X^T Y X.
template <class C, class S>
LW_INLINE ArticulatedInertia<S> to_parent(const HingePlacement<C>& k, S c, S s,
                                          PlanarInertia<S> Y) {
  // Back about z.
  turn_block(c, s, Y.A.m[0], Y.A.m[1], Y.A.m[2]);
  turn(c, s, Y.A.m[3], Y.A.m[4]);
  turn_block(c, s, Y.B[0], Y.B[1], Y.B[2], Y.B[3]);
  turn(c, s, Y.B[4], Y.B[5]);
  turn_block(c, s, Y.xx, Y.xy, Y.yy);
  // Back by d along z: B' = B - A r~, C' = C + r~ B' - B^T r~.
  const auto& A = Y.A.m;
  const C d = k.d, a = k.a;
  const S b00 = Y.B[0] - A[1] * d, b01 = Y.B[1] + A[0] * d;
  const S b10 = Y.B[2] - A[2] * d, b11 = Y.B[3] + A[1] * d;
  const S b20 = Y.B[4] - A[4] * d, b21 = Y.B[5] + A[3] * d;
  const S c00 = Y.xx - d * (b10 + Y.B[2]);
  const S c10 = Y.xy + d * (b00 - Y.B[3]);
  const S c11 = Y.yy + d * (b01 + Y.B[1]);
  // Back by a along x, which fills the zeros.
  ArticulatedInertia<S> out;
  out.A = Y.A;
  auto& B = out.B.m;
  auto& I = out.C.m;
  B[0] = b00;
  B[3] = b10;
  B[6] = b20;
  B[1] = b01 - A[3] * a;
  B[4] = b11 - A[4] * a;
  B[7] = b21 - A[5] * a;
  B[2] = A[1] * a;
  B[5] = A[2] * a;
  B[8] = A[4] * a;
  I[0] = c00;
  I[1] = c10 - a * b20;
  I[2] = c11 - a * (B[7] + b21);
  I[3] = a * b10;
  I[4] = a * B[4];
  I[5] = a * B[5];
  // Back about x.
  const C ca = k.cos_alpha, sa = k.sin_alpha;
  turn_block(ca, sa, out.A.m[2], out.A.m[4], out.A.m[5]);
  turn(ca, sa, out.A.m[1], out.A.m[3]);
  turn_block(ca, sa, B[4], B[5], B[7], B[8]);
  turn(ca, sa, B[1], B[2]);
  turn(ca, sa, B[3], B[6]);
  turn_block(ca, sa, I[2], I[4], I[5]);
  turn(ca, sa, I[1], I[3]);
  return out;
}

/// X^T Y X for any placement.
template <class S, class T>
LW_INLINE ArticulatedInertia<S> transform_to_parent(const Transform<T>& X,
                                                    const PlanarInertia<S>& Y) {
  const auto& R = X.R.m;
  ArticulatedInertia<S> turned;
  turned.A = congruence(X.R, Y.A);
  S t[9];
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) t[3 * i + j] = Y.B[2 * i] * R[j] + Y.B[2 * i + 1] * R[3 + j];
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j)
      turned.B.m[3 * i + j] = R[i] * t[j] + R[3 + i] * t[3 + j] + R[6 + i] * t[6 + j];
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    const S x = Y.xx * R[i] + Y.xy * R[3 + i], y = Y.xy * R[i] + Y.yy * R[3 + i];
#pragma GCC unroll 3
    for (int j = 0; j <= i; ++j) turned.C.m[packed(i, j)] = x * R[j] + y * R[3 + j];
  }
  return shift_to_parent(X.r, turned);
}

/// Y a, which has no moment about z.
template <class S>
LW_INLINE Force<S> operator*(const PlanarInertia<S>& Y, const Motion<S>& a) {
  Force<S> w;
  w.lin = Y.A * a.lin;
  w.lin.x += Y.B[0] * a.ang.x + Y.B[1] * a.ang.y;
  w.lin.y += Y.B[2] * a.ang.x + Y.B[3] * a.ang.y;
  w.lin.z += Y.B[4] * a.ang.x + Y.B[5] * a.ang.y;
  w.ang.x =
      Y.B[0] * a.lin.x + Y.B[2] * a.lin.y + Y.B[4] * a.lin.z + Y.xx * a.ang.x + Y.xy * a.ang.y;
  w.ang.y =
      Y.B[1] * a.lin.x + Y.B[3] * a.lin.y + Y.B[5] * a.lin.z + Y.xy * a.ang.x + Y.yy * a.ang.y;
  return w;
}

}  // namespace linkwise
