#pragma once
// The sweeps inside a group of pieces, one piece a lane. See piecewise.hpp for the equations.
#include <vector>

#include "linkwise/joints/axis_joints.hpp"
#include "linkwise/simd/sincos.hpp"
#include "linkwise/spatial/hinge.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

inline constexpr int cut_rows = 5;  ///< constrained directions of a revolute joint

/// Position k of every piece of a group: constants differ from lane to lane.
template <class S>
struct PieceBody {
  HingePlacement<S> placement;
  S theta;
  Inertia<S> inertia;
  S stand_in;  ///< 1 for a massless stand-in beyond the end of the chain, else 0: keeps D positive
  /// Index of its placement where some lane's joint is no hinge (nearly parallel axes), or -1.
  int skew = -1;
};

template <class S>
struct PieceState {
  S cosine, sine, u, D_inverse, torque;
  Motion<S> v;  ///< then the acceleration
  Force<S> p;   ///< bias wrench
  Force<S> U;   ///< then the joint load
  S row[cut_rows];
};

/// Ends of the pieces of a group.
template <class S>
struct PieceEnds {
  Transform<S> across;  ///< first body -> last body
  Motion<S> relative;   ///< velocity of the last body when the first one rests
  Motion<S> v_first;
  Motion<S> cut_columns[cut_rows];  ///< X^T Q of the outboard cut joint, as rows acting on motions
  Force<S> known_outboard;          ///< wrench of the outboard cut joint's drive on the last body
  S first_torque;                   ///< tau of the inboard cut joint
  // Results of the inward sweep.
  Motion<S> JPsi[cut_rows], JQ[cut_rows], a_free;
  S QJQ[15], PsiJPsi[15], PsiJQ[25], beta[cut_rows];
  Force<S> Psi[cut_rows];
  // Results of the cut system.
  S f_first[cut_rows], f_outboard[cut_rows];
  Motion<S> a_first, a_last;
};

template <class S>
LW_INLINE S component(const Force<S>& f, int i) {
  return i == 0   ? f.lin.x
         : i == 1 ? f.lin.y
         : i == 2 ? f.lin.z
         : i == 3 ? f.ang.x
         : i == 4 ? f.ang.y
                  : f.ang.z;
}
template <class S>
LW_INLINE S component(const Motion<S>& f, int i) {
  return i == 0   ? f.lin.x
         : i == 1 ? f.lin.y
         : i == 2 ? f.lin.z
         : i == 3 ? f.ang.x
         : i == 4 ? f.ang.y
                  : f.ang.z;
}

template <class S>
class PieceGroup {
 public:
  std::vector<PieceBody<S>> body;
  std::vector<PieceState<S>> state;
  std::vector<Transform<S>> skew;  ///< placements of the positions that are no hinges
  PieceEnds<S> ends;
  bool failed = false;

  /// Sines and cosines; the transform across each piece and the velocity it adds.
  template <class Q, class V>
  void across(Q&& q, V&& rate) {
    const size_t length = body.size();
    Transform<S> X;
    X.R.m[0] = X.R.m[4] = X.R.m[8] = broadcast<S>(1);
    Motion<S> v{};
    for (size_t k = 0; k < length; ++k) {
      const PieceBody<S>& b = body[k];
      PieceState<S>& s = state[k];
      s.u = rate(k);
      if (k == 0) continue;  // its joint is the cut
      sincos(S(q(k) + b.theta), s.sine, s.cosine);
      X = pose(b, s) * X;
      v = seen_at_child(b, s, v);
      v.ang.z += s.u;
    }
    ends.across = X;
    ends.relative = v;
  }

  void velocities() {
    Motion<S> v = ends.v_first;
    for (size_t k = 0; k < body.size(); ++k) {
      PieceState<S>& s = state[k];
      if (k > 0) {
        v = seen_at_child(body[k], s, v);
        v.ang.z += s.u;
      }
      s.v = v;
      s.p = cross_dual(v, body[k].inertia * v);
    }
  }

  /// The recursion from the last body to the first, and what the cut system needs of it.
  void tip_to_base() {
    const int last = static_cast<int>(body.size()) - 1;
    ArticulatedInertia<S> Y{};
    Force<S> p{};
    p -= ends.known_outboard;
    Force<S> Psi[cut_rows];
    S Lambda[15]{}, beta[cut_rows]{};
    for (int j = 0; j < cut_rows; ++j) Psi[j] = {ends.cut_columns[j].lin, ends.cut_columns[j].ang};
    failed = false;
    for (int k = last; k >= 0; --k) {
      const PieceBody<S>& b = body[k];
      PieceState<S>& s = state[k];
      add_inertia(Y, b.inertia);
      p += s.p;
      if (k == 0) break;
      const Force<S> U = RevoluteJoint::column(Y, 0.0);
      const S D = U.ang.z + b.stand_in;
      for (int l = 0; l < lane_count<S>; ++l) failed |= !(lane(D, l) > 0);
      const S D_inverse = 1.0 / D, u = s.torque - p.ang.z;
      const Force<S> V{D_inverse * U.lin, D_inverse * U.ang};
      const Motion<S> c = RevoluteJoint::bias(s.v, 0.0, s.u);
      s.U = U;
      s.D_inverse = D_inverse;
      for (int i = 0; i < cut_rows; ++i) {
        const S r = Psi[i].ang.z, scaled = r * D_inverse;
        s.row[i] = r;
        for (int j = 0; j <= i; ++j) Lambda[sym_index(i, j)] += scaled * Psi[j].ang.z;
        beta[i] += scaled * u;
      }
#pragma GCC unroll 5
      for (int i = 0; i < cut_rows; ++i) {
        const S r = Psi[i].ang.z;
        Psi[i] -= Force<S>{r * V.lin, r * V.ang};
        beta[i] += Psi[i].lin.x * c.lin.x + Psi[i].lin.y * c.lin.y + Psi[i].ang.x * c.ang.x +
                   Psi[i].ang.y * c.ang.y;
        Psi[i] = seen_at_parent(b, s, Psi[i]);
      }
      const PlanarInertia<S> Z = eliminate(Y, U, V);
      p += Z * c;
      p += Force<S>{u * V.lin, u * V.ang};
      s.torque = u;
      Y = b.skew < 0 ? to_parent(b.placement, s.cosine, s.sine, Z)
                     : transform_to_parent(pose(b, s), Z);
      p = seen_at_parent(b, s, p);
    }
    finish(Y, p, Psi, Lambda, beta);
  }

  /// Accelerations, then the loads of all joints but the cut ones when `loads`.
  template <class Out>
  void base_to_tip(Out&& du, bool loads) {
    Motion<S> a = ends.a_free;
    for (int j = 0; j < cut_rows; ++j) {
      a += Motion<S>{ends.f_first[j] * ends.JQ[j].lin, ends.f_first[j] * ends.JQ[j].ang};
      a +=
          Motion<S>{-ends.f_outboard[j] * ends.JPsi[j].lin, -ends.f_outboard[j] * ends.JPsi[j].ang};
    }
    ends.a_first = a;
    for (size_t k = 0; k < body.size(); ++k) {
      PieceState<S>& s = state[k];
      if (k > 0) {
        a = seen_at_child(body[k], s, a);
        a += RevoluteJoint::bias(s.v, 0.0, s.u);
        S rate = s.torque - dot(a, s.U);
        for (int j = 0; j < cut_rows; ++j) rate = rate - s.row[j] * ends.f_outboard[j];
        rate = rate * s.D_inverse;
        du(k, rate);
        a.ang.z += rate;
      }
      s.v = a;
    }
    ends.a_last = a;
    if (!loads) return;
    Force<S> w{};
    w -= ends.known_outboard;
    for (int j = 0; j < cut_rows; ++j)
      w += Force<S>{ends.f_outboard[j] * ends.cut_columns[j].lin,
                    ends.f_outboard[j] * ends.cut_columns[j].ang};
    for (size_t k = body.size(); k-- > 0;) {
      PieceState<S>& s = state[k];
      w += body[k].inertia * s.v;
      w += s.p;
      s.U = w;
      if (k > 0) w = seen_at_parent(body[k], s, w);
    }
  }

 private:
  LW_INLINE Motion<S> seen_at_child(const PieceBody<S>& b, const PieceState<S>& s,
                                    const Motion<S>& v) const {
    return b.skew < 0 ? to_child(b.placement, s.cosine, s.sine, v) : pose(b, s) * v;
  }
  LW_INLINE Force<S> seen_at_parent(const PieceBody<S>& b, const PieceState<S>& s,
                                    const Force<S>& f) const {
    return b.skew < 0 ? to_parent(b.placement, s.cosine, s.sine, f)
                      : transpose_times(pose(b, s), f);
  }
  LW_INLINE Transform<S> pose(const PieceBody<S>& b, const PieceState<S>& s) const {
    if (b.skew >= 0) return {turn_about_z(skew[b.skew].R, s.cosine, s.sine), skew[b.skew].r};
    const S c = s.cosine, n = s.sine, ca = b.placement.cos_alpha, sa = b.placement.sin_alpha;
    return {{{c, n * ca, n * sa, -n, c * ca, c * sa, S{}, -sa, ca}},
            {b.placement.a, -b.placement.d * sa, b.placement.d * ca}};
  }

  static LW_INLINE PlanarInertia<S> eliminate(const ArticulatedInertia<S>& Y, const Force<S>& U,
                                              const Force<S>& V) {
    PlanarInertia<S> Z;
    const S v[5] = {V.lin.x, V.lin.y, V.lin.z, V.ang.x, V.ang.y},
            u[5] = {U.lin.x, U.lin.y, U.lin.z, U.ang.x, U.ang.y};
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
#pragma GCC unroll 3
      for (int j = 0; j <= i; ++j) Z.A.m[sym_index(i, j)] = Y.A.m[sym_index(i, j)] - v[i] * u[j];
      Z.B[2 * i] = Y.B.m[3 * i] - v[i] * u[3];
      Z.B[2 * i + 1] = Y.B.m[3 * i + 1] - v[i] * u[4];
    }
    Z.xx = Y.C.m[0] - v[3] * u[3];
    Z.xy = Y.C.m[1] - v[4] * u[3];
    Z.yy = Y.C.m[2] - v[4] * u[4];
    return Z;
  }

  void finish(const ArticulatedInertia<S>& Y, const Force<S>& p, const Force<S>* Psi,
              const S* Lambda, const S* beta) {
    S L[21];
    failed |= !factor(Y, L);
    Force<S> free{-p.lin, -p.ang};
    free.ang.z += ends.first_torque;
    ends.a_free = solve(L, free);
    for (int j = 0; j < cut_rows; ++j) {
      Force<S> unit{};
      S* parts[6] = {&unit.lin.x, &unit.lin.y, &unit.lin.z, &unit.ang.x, &unit.ang.y, &unit.ang.z};
      *parts[j] = broadcast<S>(1);
      ends.JQ[j] = solve(L, unit);
      ends.JPsi[j] = solve(L, Psi[j]);
      ends.Psi[j] = Psi[j];
      ends.beta[j] = beta[j] + dot(ends.a_free, Psi[j]);
    }
    for (int i = 0; i < cut_rows; ++i)
      for (int j = 0; j < cut_rows; ++j) {
        if (j <= i) {
          ends.QJQ[sym_index(i, j)] = component(ends.JQ[j], i);
          ends.PsiJPsi[sym_index(i, j)] = Lambda[sym_index(i, j)] + dot(ends.JPsi[j], Psi[i]);
        }
        ends.PsiJQ[5 * i + j] = dot(ends.JQ[j], Psi[i]);
      }
  }

  /// Cholesky factor with reciprocal diagonal, packed.
  static bool factor(const ArticulatedInertia<S>& Y, S* L) {
    const auto entry = [&](int i, int j) -> S {
      return i < 3   ? Y.A.m[sym_index(i, j)]
             : j < 3 ? Y.B.m[3 * j + i - 3]
                     : Y.C.m[sym_index(i - 3, j - 3)];
    };
    bool ok = true;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j <= i; ++j) {
        S x = entry(i, j);
        for (int l = 0; l < j; ++l) x = x - L[sym_index(i, l)] * L[sym_index(j, l)];
        if (i == j) {
          for (int l = 0; l < lane_count<S>; ++l) ok &= lane(x, l) > 0;
          L[sym_index(i, i)] = 1.0 / square_root(x);
        } else {
          L[sym_index(i, j)] = x * L[sym_index(j, j)];
        }
      }
    return ok;
  }

  static Motion<S> solve(const S* L, const Force<S>& f) {
    S x[6] = {f.lin.x, f.lin.y, f.lin.z, f.ang.x, f.ang.y, f.ang.z};
    for (int i = 0; i < 6; ++i) {
      for (int l = 0; l < i; ++l) x[i] = x[i] - L[sym_index(i, l)] * x[l];
      x[i] = x[i] * L[sym_index(i, i)];
    }
    for (int i = 5; i >= 0; --i) {
      for (int l = i + 1; l < 6; ++l) x[i] = x[i] - L[sym_index(l, i)] * x[l];
      x[i] = x[i] * L[sym_index(i, i)];
    }
    return to_motion(x);
  }
};

}  // namespace linkwise
