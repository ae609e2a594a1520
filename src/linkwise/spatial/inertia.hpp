#pragma once
// Rigid-body and articulated-body inertias in packed form [featherstone2008, ch. 2 and 7].
#include "linkwise/spatial/motion.hpp"

namespace linkwise {

/// Inertia about the frame's origin: mass, first moment m c, rotational inertia.
template <class C>
struct Inertia {
  C m{};
  Vec3<C> mc;
  Sym3<C> I;
};

/// Momentum h = M v = (m v + w x mc, mc x v + I w).
template <class C, class S>
LW_INLINE Force<Wider<C, S>> operator*(const Inertia<C>& M, const Motion<S>& v) {
  return {M.m * v.lin + cross(v.ang, M.mc), cross(M.mc, v.lin) + M.I * v.ang};
}

/// Symmetric 6x6 [A B; B^T C], linear part first.
template <class S>
struct ArticulatedInertia {
  Sym3<S> A;
  Mat3<S> B;
  Sym3<S> C;
};

/// adds a rigid body: A += m 1, B += -mc~, C += I.
template <class S, class C>
LW_INLINE void add_inertia(ArticulatedInertia<S>& Y, const Inertia<C>& M) {
  Y.A.m[0] += M.m;
  Y.A.m[2] += M.m;
  Y.A.m[5] += M.m;
  Y.B.m[1] += M.mc.z;
  Y.B.m[2] -= M.mc.y;
  Y.B.m[3] -= M.mc.z;
  Y.B.m[5] += M.mc.x;
  Y.B.m[6] += M.mc.y;
  Y.B.m[7] -= M.mc.x;
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) Y.C.m[i] += M.I.m[i];
}

template <class S, class T>
LW_INLINE Force<Wider<S, T>> operator*(const ArticulatedInertia<S>& Y, const Motion<T>& v) {
  return {Y.A * v.lin + Y.B * v.ang, transpose_times(Y.B, v.lin) + Y.C * v.ang};
}

/// Subtracts the outer product V U^T, of which V is a multiple of U, from a symmetric 6x6 [A B; B^T
/// C].
template <class Symmetric, class S>
LW_INLINE void subtract_outer(Symmetric& Y, const Force<S>& V, const Force<S>& U) {
  const S v[6] = {V.lin.x, V.lin.y, V.lin.z, V.ang.x, V.ang.y, V.ang.z};
  const S u[6] = {U.lin.x, U.lin.y, U.lin.z, U.ang.x, U.ang.y, U.ang.z};
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
#pragma GCC unroll 3
    for (int j = 0; j <= i; ++j) {
      Y.A.m[packed(i, j)] -= v[i] * u[j];
      Y.C.m[packed(i, j)] -= v[3 + i] * u[3 + j];
    }
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) Y.B.m[3 * i + j] -= v[i] * u[3 + j];
  }
}

/// The inertia H about a frame's origin, seen at the frame that it is shifted from by r:
/// B' = B - A r~, C' = C + r~ B' - B^T r~.
template <class S, class T>
LW_INLINE ArticulatedInertia<S> shift_to_parent(const Vec3<T>& r, const ArticulatedInertia<S>& H) {
  const auto& A = H.A.m;
  ArticulatedInertia<S> out = H;
  auto& G = out.B.m;
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    const S a0 = A[packed(i, 0)], a1 = A[packed(i, 1)], a2 = A[packed(i, 2)];
    G[3 * i] -= a1 * r.z - a2 * r.y;
    G[3 * i + 1] -= a2 * r.x - a0 * r.z;
    G[3 * i + 2] -= a0 * r.y - a1 * r.x;
  }
  // Rows of r~ B' minus rows of B^T r~, lower triangle only.
  const auto rg = [&](int i, int j) -> S {
    return i == 0   ? r.y * G[6 + j] - r.z * G[3 + j]
           : i == 1 ? r.z * G[j] - r.x * G[6 + j]
                    : r.x * G[3 + j] - r.y * G[j];
  };
  const auto hr = [&](int i, int j) -> S {
    const S e0 = H.B.m[i], e1 = H.B.m[3 + i], e2 = H.B.m[6 + i];
    return j == 0 ? e1 * r.z - e2 * r.y : j == 1 ? e2 * r.x - e0 * r.z : e0 * r.y - e1 * r.x;
  };
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
    for (int j = 0; j <= i; ++j) out.C.m[packed(i, j)] += rg(i, j) - hr(i, j);
  return out;
}

/// X^T Y X: the inertia seen at the parent frame.
template <class S, class T>
LW_INLINE ArticulatedInertia<Wider<S, T>> transform_to_parent(const Transform<T>& X,
                                                              const ArticulatedInertia<S>& Y) {
  using W = Wider<S, T>;
  return shift_to_parent(
      X.r, ArticulatedInertia<W>{congruence(X.R, Y.A), congruence(X.R, Y.B), congruence(X.R, Y.C)});
}

template <class S>
LW_INLINE void operator+=(ArticulatedInertia<S>& a, const ArticulatedInertia<S>& b) {
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) {
    a.A.m[i] += b.A.m[i];
    a.C.m[i] += b.C.m[i];
  }
#pragma GCC unroll 9
  for (int i = 0; i < 9; ++i) a.B.m[i] += b.B.m[i];
}

}  // namespace linkwise
