#pragma once
// 3-vectors and 3x3 matrices on any scalar. Mixed products (lanes times model constants held as
// plain doubles) give the wider type.
#include "linkwise/base/packed.hpp"

namespace linkwise {

template <class A, class B>
using Wider = decltype(A{} * B{});

template <class S>
struct Vec3 {
  S x{}, y{}, z{};
};

template <class A, class B>
LW_INLINE Vec3<Wider<A, B>> operator+(const Vec3<A>& a, const Vec3<B>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class A, class B>
LW_INLINE Vec3<Wider<A, B>> operator-(const Vec3<A>& a, const Vec3<B>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class A>
LW_INLINE Vec3<A> operator-(const Vec3<A>& a) {
  return {-a.x, -a.y, -a.z};
}
template <class A, class B>
LW_INLINE Vec3<Wider<A, B>> operator*(const A& s, const Vec3<B>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class A, class B>
LW_INLINE Vec3<A>& operator+=(Vec3<A>& a, const Vec3<B>& b) {
  a.x += b.x;
  a.y += b.y;
  a.z += b.z;
  return a;
}
template <class A, class B>
LW_INLINE Vec3<A>& operator-=(Vec3<A>& a, const Vec3<B>& b) {
  a.x -= b.x;
  a.y -= b.y;
  a.z -= b.z;
  return a;
}
template <class A, class B>
LW_INLINE Wider<A, B> dot(const Vec3<A>& a, const Vec3<B>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class A, class B>
LW_INLINE Vec3<Wider<A, B>> cross(const Vec3<A>& a, const Vec3<B>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Row-major 3x3 matrix.
template <class S>
struct Mat3 {
  S m[9]{};

  static Mat3 identity() {
    Mat3 e;
    e.m[0] = e.m[4] = e.m[8] = e.m[0] + 1.0;
    return e;
  }
};

template <class A, class B>
LW_INLINE Vec3<Wider<A, B>> operator*(const Mat3<A>& a, const Vec3<B>& v) {
  return {a.m[0] * v.x + a.m[1] * v.y + a.m[2] * v.z, a.m[3] * v.x + a.m[4] * v.y + a.m[5] * v.z,
          a.m[6] * v.x + a.m[7] * v.y + a.m[8] * v.z};
}
/// a^T v
template <class A, class B>
LW_INLINE Vec3<Wider<A, B>> transpose_times(const Mat3<A>& a, const Vec3<B>& v) {
  return {a.m[0] * v.x + a.m[3] * v.y + a.m[6] * v.z, a.m[1] * v.x + a.m[4] * v.y + a.m[7] * v.z,
          a.m[2] * v.x + a.m[5] * v.y + a.m[8] * v.z};
}
template <class A, class B>
LW_INLINE Mat3<Wider<A, B>> operator*(const Mat3<A>& a, const Mat3<B>& b) {
  Mat3<Wider<A, B>> c;
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j)
      c.m[3 * i + j] =
          a.m[3 * i] * b.m[j] + a.m[3 * i + 1] * b.m[3 + j] + a.m[3 * i + 2] * b.m[6 + j];
  return c;
}
template <class A>
LW_INLINE Mat3<A> transpose(const Mat3<A>& a) {
  return {{a.m[0], a.m[3], a.m[6], a.m[1], a.m[4], a.m[7], a.m[2], a.m[5], a.m[8]}};
}

/// Symmetric 3x3 matrix, packed lower triangle: xx, xy, yy, xz, yz, zz.
template <class S>
struct Sym3 {
  S m[6]{};
};

template <class A, class B>
LW_INLINE Vec3<Wider<A, B>> operator*(const Sym3<A>& a, const Vec3<B>& v) {
  return {a.m[0] * v.x + a.m[1] * v.y + a.m[3] * v.z, a.m[1] * v.x + a.m[2] * v.y + a.m[4] * v.z,
          a.m[3] * v.x + a.m[4] * v.y + a.m[5] * v.z};
}

/// R^T S R for a symmetric S.
template <class A, class B>
LW_INLINE Sym3<Wider<A, B>> congruence(const Mat3<A>& R, const Sym3<B>& S) {
  Mat3<Wider<A, B>> t;
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j)
      t.m[3 * i + j] = S.m[packed(i, 0)] * R.m[j] + S.m[packed(i, 1)] * R.m[3 + j] +
                       S.m[packed(i, 2)] * R.m[6 + j];
  Sym3<Wider<A, B>> y;
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
    for (int j = 0; j <= i; ++j)
      y.m[packed(i, j)] = R.m[i] * t.m[j] + R.m[3 + i] * t.m[3 + j] + R.m[6 + i] * t.m[6 + j];
  return y;
}

/// R^T B R for a general B.
template <class A, class B>
LW_INLINE Mat3<Wider<A, B>> congruence(const Mat3<A>& R, const Mat3<B>& M) {
  Mat3<Wider<A, B>> y, t = M * R;
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j)
      y.m[3 * i + j] = R.m[i] * t.m[j] + R.m[3 + i] * t.m[3 + j] + R.m[6 + i] * t.m[6 + j];
  return y;
}

}  // namespace linkwise
