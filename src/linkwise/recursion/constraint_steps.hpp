#pragma once
// The steps of the constraint-force elimination, one body at a time, for joints of one axis;
// constraint_stack_steps.hpp has the others. dynamics/constraint_elimination.hpp has the equations
// and the order.
//
// What a joint of one axis transmits are six numbers f: the first five do no work, and the motion
// subspace P is dual to the last, which is the drive's. In terms of forces and moments,
//     about z:   fx  fy  fz             nx  ny  nz
//     along z:   fx  fy  nz             nx  ny  fz
//     screw:     fx  fy  fz - pitch nz  nx  ny  nz
// are the columns of the basis E. The joint's own motion maps the span of the first five to itself,
// so that they may be taken in the frame before the motion. An armature I adds P P^T / I to the
// compliance, which in this basis is 1/I in the last place.
//
// Blocks are packed, of 5 or 6 rows. Loops over them are written so that they unroll before a
// vectoriser sees them: it would read in wide words what was just written in narrow ones, a stall
// of a dozen cycles each time.
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "linkwise/base/tolerances.hpp"
#include "linkwise/kinematics/placement.hpp"
#include "linkwise/recursion/steps.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

/// X Phi' X^T (lower triangle by rows) and X Phi' of a joint, in the directions that it constrains.
template <class T>
struct Across {
  T W[21];
  T K[6][6];
};

template <class S>
struct JointElimination {
  S L[21];     ///< of S = L D L^T, packed, the diagonal holds 1 / D
  S V[6][6];   ///< D^-1 Z
  S known[6];  ///< D^-1 L^-1 b
  S f[6];      ///< the joint's unknowns

  /// D: B^T Phi B + compliance, lower triangle by rows. Takes `before`, the parent's answer, to
  /// `after`; they may be the same. Returns a number that is positive when S is positive definite.
  template <int rows, class T>
  LW_INLINE S eliminate(S* D, const Across<T>& across, const Compliance<T>& before,
                        Compliance<S>& after) {
    constexpr int entries = packed(rows, 0);
#pragma GCC unroll 21
    for (int i = 0; i < entries; ++i) D[i] = D[i] + across.W[i];
    const Factor<rows> F = factor<rows>(D);
    // Entry by entry rather than row by row: what is summed stays in a register.
    S Z[rows][6], local[rows][6];  // what is stored elsewhere need not be read again
#pragma GCC unroll 6
    for (int c = 0; c < 6; ++c)
#pragma GCC unroll 6
      for (int i = 0; i < rows; ++i) {
        S z = across.K[i][c] + S{};
#pragma GCC unroll 6
        for (int j = 0; j < rows; ++j)
          if (j < i) z = z - F.L[packed(i, j)] * Z[j][c];
        Z[i][c] = z;
        local[i][c] = F.L[packed(i, i)] * z;
        V[i][c] = local[i][c];
      }
#pragma GCC unroll 6
    for (int i = 0; i < 6; ++i)
#pragma GCC unroll 6
      for (int j = 0; j <= i; ++j) {
        S x = entry(before, i, j) + S{};
#pragma GCC unroll 6
        for (int k = 0; k < rows; ++k) x = x - local[k][i] * Z[k][j];
        entry(after, i, j) = x;
      }
    return F.least;
  }

  /// A joint to the ground, which does not answer.
  template <int rows>
  LW_INLINE S eliminate_root(const S* D) {
    const S least = factor<rows>(D).least;
    for (auto& row : V) std::fill(row, row + 6, S{});
    return least;
  }

  /// y = L^-1 b; returns what that takes from the parent's free acceleration.
  template <int rows>
  LW_INLINE Motion<S> reduce(const S* b) {
    S y[rows];
    Motion<S> taken{};
#pragma GCC unroll 6
    for (int i = 0; i < rows; ++i) {
      y[i] = b[i];
#pragma GCC unroll 6
      for (int j = 0; j < rows; ++j)
        if (j < i) y[i] = y[i] - L[packed(i, j)] * y[j];
      known[i] = L[packed(i, i)] * y[i];
      taken += Motion<S>{{y[i] * V[i][0], y[i] * V[i][1], y[i] * V[i][2]},
                         {y[i] * V[i][3], y[i] * V[i][4], y[i] * V[i][5]}};
    }
    return taken;
  }

  /// f = L^-T (D^-1 L^-1 b + V r) for the wrench r on the parent.
  template <int rows>
  LW_INLINE void solve_back(const Force<S>& r) {
    S x[rows];
#pragma GCC unroll 6
    for (int i = 0; i < rows; ++i)
      x[i] = known[i] + V[i][0] * r.lin.x + V[i][1] * r.lin.y + V[i][2] * r.lin.z +
             V[i][3] * r.ang.x + V[i][4] * r.ang.y + V[i][5] * r.ang.z;
#pragma GCC unroll 6
    for (int k = 0; k < rows; ++k) {
      const int i = rows - 1 - k;
#pragma GCC unroll 6
      for (int j = 0; j < rows; ++j)
        if (j > i) x[i] = x[i] - L[packed(j, i)] * x[j];
    }
#pragma GCC unroll 6
    for (int i = 0; i < rows; ++i) f[i] = x[i];
  }

 private:
  template <int rows>
  struct Factor {
    S L[21], least;
  };

  /// The twin of ldlt_factor() in linear, row by row: merging them would change one's last bits.
  template <int rows>
  LW_INLINE Factor<rows> factor(const S* D) {
    Factor<rows> out;
#pragma GCC unroll 6
    for (int i = 0; i < rows; ++i) {
      S t[rows];
      S d = D[packed(i, i)];
#pragma GCC unroll 6
      for (int j = 0; j < rows; ++j) {
        if (j >= i) continue;
        t[j] = D[packed(i, j)];
#pragma GCC unroll 6
        for (int l = 0; l < rows; ++l)
          if (l < j) t[j] = t[j] - t[l] * out.L[packed(j, l)];
        out.L[packed(i, j)] = t[j] * out.L[packed(j, j)];
        d = d - t[j] * out.L[packed(i, j)];
      }
      const S margin = d - smallest_pivot * D[packed(i, i)];
      out.least = i == 0 ? margin : smaller(out.least, margin);
      out.L[packed(i, i)] = 1.0 / d;
    }
    constexpr int entries = packed(rows, 0);
#pragma GCC unroll 21
    for (int i = 0; i < entries; ++i) L[i] = out.L[i];
    return out;
  }
};

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

/// Five rows, or six where a joint drives through its rotor: calls f(rows), the number as a
/// constant.
template <class J, class F>
LW_INLINE void with_rows(const BodyConstants<double>& k, F&& f) {
  using Five = std::integral_constant<int, 5>;
  using Six = std::integral_constant<int, 6>;
  if constexpr (J::leaves_zero_row)
    f(Five{});
  else if constexpr (!J::slides)
    f(Six{});
  else if (k.armature > 0)
    f(Six{});
  else
    f(Five{});
}

/// A drive without rotor: a plain torque or force on z, which the joint's motion leaves alone.
/// It is added to the wrench on the body and taken from the parent's, if there is one.
template <class J, class S>
LW_INLINE void add_drive(const Transform<double>& tree, const S& tau, Force<S>& on_body,
                         Force<S>* on_parent) {
  const auto& R = tree.R.m;
  const Vec3<S> z{R[6] * tau, R[7] * tau, R[8] * tau};
  if constexpr (J::turns) {
    on_body.ang.z += tau;
    if (on_parent) on_parent->ang -= z;
  } else {
    on_body.lin.z += tau;
    if (on_parent) *on_parent -= Force<S>{z, cross(tree.r, z)};
  }
}

/// What an axis keeps of its body.
template <class S>
struct ConstrainedAxis {
  AxisPose<S> at;
  Motion<S> along;  ///< Phi_n's column of the drive's direction
};

/// b, in the frame before the joint's motion. alpha: the body's answer to no wrench; v: its
/// velocity.
template <class J, int rows, class S>
LW_INLINE void calc_gap(const BodyConstants<double>& k, const AxisPose<S>& at,
                        const Motion<S>& a_parent, const Motion<S>& alpha, const Motion<S>& v,
                        const S& rate, const S& tau, S* b) {
  Motion<S> gap = alpha;
  gap += J::bias(v, k.pitch, S(-rate));
  undo_motion<J>(at, gap);
  const Motion<S> carried = before_motion<J>(k, a_parent);
  to_components<J>(Motion<S>{carried.lin - gap.lin, carried.ang - gap.ang}, k.pitch, b);
  if constexpr (rows == 6) b[5] = b[5] + tau / k.armature;
}

/// D = B^T Phi B + compliance, in the frame before the joint's motion.
template <class J, int rows, class S>
LW_INLINE void assemble(const BodyConstants<double>& k, Compliance<S> Phi, ConstrainedAxis<S>& axis,
                        S* D) {
  axis.along = column(Phi, J::turns ? 5 : 2);
  undo_motion<J>(axis.at, Phi);
  to_components<J, rows>(Phi, k.pitch, D);
  if constexpr (rows == 6) D[20] = D[20] + 1 / k.armature;
}

/// Wrench of the unknowns f on the body, in the frame before the joint's motion.
template <class J, int rows, class S>
LW_INLINE Force<S> to_wrench(const BodyConstants<double>& k, const S* f) {
  return to_wrench<J>(f, rows == 6 ? f[5] : S{}, k.pitch);
}

/// Returns du; a: the body's acceleration. r: the unknown wrench on it.
template <class J, class S>
LW_INLINE S accelerate(const BodyConstants<double>& k, const ConstrainedAxis<S>& axis,
                       const Motion<S>& alpha, const Motion<S>& v, const S& rate, const Force<S>& r,
                       const Motion<S>& a_parent, Motion<S>& a) {
  a = MovedAxis<J, S>{k, axis.at}.to_child(a_parent);
  a += J::bias(v, k.pitch, rate);
  const S found = dot(axis.along, r) + rate_of<J>(alpha) - rate_of<J>(a);
  J::add_rate(a, k.pitch, found);
  return found;
}

/// out(f) for the unknowns of a joint in the bases that calc_joint_constraint() chooses, from its
/// load.
template <class J, class S, class Out>
LW_INLINE void for_unknowns(const BodyConstants<double>& k, const Force<S>& load, Out&& out) {
  if (k.armature > 0) out(J::project(load, k.pitch));
  out(load.lin.x);
  out(load.lin.y);
  if constexpr (!J::slides)
    out(load.lin.z);
  else if constexpr (J::turns)
    out((load.lin.z - k.pitch * load.ang.z) / std::sqrt(1 + k.pitch * k.pitch));
  out(load.ang.x);
  out(load.ang.y);
  if constexpr (!J::turns) out(load.ang.z);
}

}  // namespace linkwise
