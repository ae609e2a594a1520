#pragma once
// Dense 6x6 matrices, row-major, and the inverse of a rigid body's inertia, for the places that
// assemble blocks. Rows and columns are ordered linear first.
#include <array>
#include <utility>

#include "linkwise/simd/cholesky.hpp"
#include "linkwise/spatial/hinge.hpp"

namespace linkwise {

template <class S>
using Vector6 = std::array<S, 6>;
template <class S>
using Matrix6 = std::array<S, 36>;

template <class S>
LW_INLINE Vector6<S> to_array(const Motion<S>& v) {
  return {v.lin.x, v.lin.y, v.lin.z, v.ang.x, v.ang.y, v.ang.z};
}
template <class S>
LW_INLINE Vector6<S> to_array(const Force<S>& v) {
  return {v.lin.x, v.lin.y, v.lin.z, v.ang.x, v.ang.y, v.ang.z};
}
template <class S>
LW_INLINE Motion<S> to_motion(const S* v) {
  return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}
template <class S>
LW_INLINE Force<S> to_force(const S* v) {
  return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

/// Entry (i, j) of a Compliance or an ArticulatedInertia.
template <class L>
LW_INLINE auto& entry(L& matrix, int i, int j) {
  if (i < j) std::swap(i, j);
  return i < 3   ? matrix.A.m[packed(i, j)]
         : j < 3 ? matrix.B.m[3 * j + i - 3]
                 : matrix.C.m[packed(i - 3, j - 3)];
}

/// Cholesky factor of Y (simd/cholesky.hpp).
template <class S>
bool factor(const ArticulatedInertia<S>& Y, S* L, double smallest_pivot = 0) {
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) L[packed(i, j)] = entry(Y, i, j);
  return cholesky_factor(6, L, smallest_pivot);
}

/// Y^-1 f with that factor.
template <class S>
Motion<S> solve(const S* L, const Force<S>& f) {
  Vector6<S> x = to_array(f);
  cholesky_solve(6, L, x.data());
  return to_motion(x.data());
}

/// Inverse of a body's 6x6 inertia: [1/m - c~ Ic^-1 c~, c~ Ic^-1; ., Ic^-1], so that a = M^-1 w.
/// Stored as the symmetric [A B; B^T C]; multiply() takes a wrench to an acceleration.
template <class T>
struct Compliance {
  Sym3<T> A;
  Mat3<T> B;
  Sym3<T> C;
};

/// Inverse of a symmetric positive definite 3x3 matrix by cofactors.
inline Sym3<double> inverse(const Sym3<double>& s) {
  const double a = s.m[0], b = s.m[1], c = s.m[2], d = s.m[3], e = s.m[4], f = s.m[5];
  const double A = c * f - e * e, B = d * e - b * f, D = b * e - c * d;
  const double k = 1 / (a * A + b * B + d * D);
  return {{k * A, k * B, k * (a * f - d * d), k * D, k * (b * d - a * e), k * (a * c - b * b)}};
}

inline Compliance<double> invert_inertia(const Inertia<double>& M) {
  const Vec3<double> c = (1 / M.m) * M.mc;
  Sym3<double> central = M.I;
  central.m[0] -= M.m * (c.y * c.y + c.z * c.z);
  central.m[1] += M.m * c.x * c.y;
  central.m[2] -= M.m * (c.x * c.x + c.z * c.z);
  central.m[3] += M.m * c.x * c.z;
  central.m[4] += M.m * c.y * c.z;
  central.m[5] -= M.m * (c.x * c.x + c.y * c.y);
  Compliance<double> out;
  out.C = inverse(central);
  const auto& J = out.C;
  const Vec3<double> columns[3] = {
      {J.m[0], J.m[1], J.m[3]}, {J.m[1], J.m[2], J.m[4]}, {J.m[3], J.m[4], J.m[5]}};
  for (int j = 0; j < 3; ++j) {
    const Vec3<double> b = cross(c, columns[j]);
    out.B.m[j] = b.x;
    out.B.m[3 + j] = b.y;
    out.B.m[6 + j] = b.z;
  }
  // A = 1/m + (c~ Ic^-1) c~^T: row i of B crossed with c.
  for (int i = 0; i < 3; ++i) {
    const Vec3<double> row{out.B.m[3 * i], out.B.m[3 * i + 1], out.B.m[3 * i + 2]};
    const Vec3<double> a = cross(c, row);
    const double values[3] = {a.x, a.y, a.z};
    for (int j = 0; j <= i; ++j) out.A.m[packed(i, j)] = values[j] + (i == j ? 1 / M.m : 0);
  }
  return out;
}

template <class C, class S>
LW_INLINE Motion<Wider<C, S>> operator*(const Compliance<C>& L, const Force<S>& w) {
  return {L.A * w.lin + L.B * w.ang, transpose_times(L.B, w.lin) + L.C * w.ang};
}

/// The same on lanes.
template <class S, class T>
LW_INLINE Compliance<S> widen(const Compliance<T>& from) {
  Compliance<S> to;
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) {
    to.A.m[i] = from.A.m[i] + S{};
    to.C.m[i] = from.C.m[i] + S{};
  }
#pragma GCC unroll 9
  for (int i = 0; i < 9; ++i) to.B.m[i] = from.B.m[i] + S{};
  return to;
}

/// Column j: the acceleration that a unit wrench causes.
template <class C>
LW_INLINE Motion<C> column(const Compliance<C>& L, int j) {
  return {{entry(L, 0, j), entry(L, 1, j), entry(L, 2, j)},
          {entry(L, 3, j), entry(L, 4, j), entry(L, 5, j)}};
}

/// L seen from axes turned about z by minus the angle with this cosine and sine.
template <class S>
LW_INLINE void turn_back(const S& c, const S& s, Compliance<S>& L) {
  turn_block(c, s, L.A.m[0], L.A.m[1], L.A.m[2]);
  turn(c, s, L.A.m[3], L.A.m[4]);
  turn_block(c, s, L.B.m[0], L.B.m[1], L.B.m[3], L.B.m[4]);
  turn(c, s, L.B.m[2], L.B.m[5]);
  turn(c, s, L.B.m[6], L.B.m[7]);
  turn_block(c, s, L.C.m[0], L.C.m[1], L.C.m[2]);
  turn(c, s, L.C.m[3], L.C.m[4]);
}

/// L seen from an origin moved along z by minus d: B' = B + E C, A' = A + E B^T + B' E^T, where
/// E w = d z x w.
template <class S>
LW_INLINE void slide_back(const S& d, Compliance<S>& L) {
  auto& A = L.A.m;
  auto& B = L.B.m;
  const auto& C = L.C.m;
  const S b01 = B[1], b00 = B[0], b10 = B[3];
#pragma GCC unroll 3
  for (int j = 0; j < 3; ++j) {
    B[j] = B[j] - d * C[packed(1, j)];
    B[3 + j] = B[3 + j] + d * C[packed(0, j)];
  }
  A[0] = A[0] - d * (b01 + B[1]);
  A[1] = A[1] + d * (b00 - B[4]);
  A[2] = A[2] + d * (b10 + B[3]);
  A[3] = A[3] - d * B[7];
  A[4] = A[4] + d * B[6];
}

template <class C>
LW_INLINE Matrix6<C> to_matrix(const Compliance<C>& L) {
  Matrix6<C> out;
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) {
      out[6 * i + j] = L.A.m[packed(i, j)];
      out[6 * i + 3 + j] = L.B.m[3 * i + j];
      out[6 * (3 + j) + i] = L.B.m[3 * i + j];
      out[6 * (3 + i) + 3 + j] = L.C.m[packed(i, j)];
    }
  return out;
}

}  // namespace linkwise
