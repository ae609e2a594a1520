#pragma once
// Spatial algebra written out as dense 6x6 matrices: the obvious twin of the packed forms.

#include <array>
#include <cmath>

#include "base/draws.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise::testing {

using Dense6 = std::array<std::array<double, 6>, 6>;
using Array6 = std::array<double, 6>;

inline Dense6 multiply(const Dense6& a, const Dense6& b) {
  Dense6 c{};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (int k = 0; k < 6; ++k) c[i][j] += a[i][k] * b[k][j];
  return c;
}
inline Array6 multiply(const Dense6& a, const Array6& x) {
  Array6 y{};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) y[i] += a[i][j] * x[j];
  return y;
}
inline Dense6 transposed(const Dense6& a) {
  Dense6 t{};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) t[i][j] = a[j][i];
  return t;
}

/// Gauss-Jordan with row pivoting.
inline Dense6 inverted(Dense6 a) {
  Dense6 b{};
  for (int i = 0; i < 6; ++i) b[i][i] = 1;
  for (int j = 0; j < 6; ++j) {
    int p = j;
    for (int i = j; i < 6; ++i)
      if (std::abs(a[i][j]) > std::abs(a[p][j])) p = i;
    std::swap(a[j], a[p]);
    std::swap(b[j], b[p]);
    for (int i = 0; i < 6; ++i) {
      const double factor = i == j ? 0 : a[i][j] / a[j][j];
      for (int k = 0; k < 6; ++k) {
        a[i][k] -= factor * a[j][k];
        b[i][k] -= factor * b[j][k];
      }
    }
  }
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < 6; ++k) b[i][k] /= a[i][i];
  return b;
}

inline Mat3<double> tilde(const Vec3<double>& a) {
  return {{0, -a.z, a.y, a.z, 0, -a.x, -a.y, a.x, 0}};
}

inline void set_corner(Dense6& out, int row, int column, const Mat3<double>& m, double factor = 1) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[row + i][column + j] = factor * m.m[3 * i + j];
}
inline Mat3<double> full(const Sym3<double>& s) {
  return {{s.m[0], s.m[1], s.m[3], s.m[1], s.m[2], s.m[4], s.m[3], s.m[4], s.m[5]}};
}

inline Dense6 dense(const Transform<double>& X) {
  Dense6 out{};
  set_corner(out, 0, 0, X.R);
  set_corner(out, 0, 3, X.R * tilde(X.r), -1);
  set_corner(out, 3, 3, X.R);
  return out;
}
/// The matrix of v x.
inline Dense6 dense_cross(const Motion<double>& v) {
  Dense6 out{};
  set_corner(out, 0, 0, tilde(v.ang));
  set_corner(out, 0, 3, tilde(v.lin));
  set_corner(out, 3, 3, tilde(v.ang));
  return out;
}
inline Dense6 dense(const Inertia<double>& M) {
  Dense6 out{};
  set_corner(out, 0, 0, {{M.m, 0, 0, 0, M.m, 0, 0, 0, M.m}});
  set_corner(out, 0, 3, tilde(M.mc), -1);
  set_corner(out, 3, 0, tilde(M.mc));
  set_corner(out, 3, 3, full(M.I));
  return out;
}
inline Dense6 dense(const ArticulatedInertia<double>& Y) {
  Dense6 out{};
  set_corner(out, 0, 0, full(Y.A));
  set_corner(out, 0, 3, Y.B);
  set_corner(out, 3, 0, transpose(Y.B));
  set_corner(out, 3, 3, full(Y.C));
  return out;
}

inline Vec3<double> random_vector3(Draws& draws, double size = 1) {
  return {size * draws.normal(), size * draws.normal(), size * draws.normal()};
}

/// From a random quaternion.
inline Mat3<double> random_rotation(Draws& draws) {
  double x = draws.normal(), y = draws.normal(), z = draws.normal(), w = draws.normal();
  const double k = 2 / (x * x + y * y + z * z + w * w);
  return {{1 - k * (y * y + z * z), k * (x * y - z * w), k * (x * z + y * w), k * (x * y + z * w),
           1 - k * (x * x + z * z), k * (y * z - x * w), k * (x * z - y * w), k * (y * z + x * w),
           1 - k * (x * x + y * y)}};
}

/// Central inertia of some random particles, which any real body could have.
inline Sym3<double> random_central_inertia(Draws& draws, double size) {
  Sym3<double> I;
  for (int i = 0; i < 5; ++i) {
    const Vec3<double> r = random_vector3(draws, size);
    I.m[0] += r.y * r.y + r.z * r.z;
    I.m[1] -= r.x * r.y;
    I.m[2] += r.x * r.x + r.z * r.z;
    I.m[3] -= r.x * r.z;
    I.m[4] -= r.y * r.z;
    I.m[5] += r.x * r.x + r.y * r.y;
  }
  return I;
}

/// About the frame's origin, of a body whose centre of mass is elsewhere.
inline Inertia<double> random_inertia(Draws& draws) {
  const double m = draws.uniform(0.2, 3);
  const Vec3<double> c = random_vector3(draws, 0.4);
  Inertia<double> M{m, m * c, random_central_inertia(draws, 0.3)};
  const Mat3<double> shift = transpose(tilde(c)) * tilde(c);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) M.I.m[packed(i, j)] += m * shift.m[3 * i + j];
  return M;
}

}  // namespace linkwise::testing
