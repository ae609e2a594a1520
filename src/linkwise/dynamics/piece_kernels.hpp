#pragma once
// The sweeps inside a group of pieces, one piece a lane. See piecewise.hpp for the equations.
#include <vector>

#include "linkwise/dynamics/lane_bodies.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

inline constexpr int cut_rows = 5;  ///< constrained directions of a revolute joint

template <class S>
struct PieceState {
  LaneTurn<S> turn;
  S u, D_inverse, torque;
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
  LaneBodies<S> body;
  std::vector<PieceState<S>> state;
  PieceEnds<S> ends;
  bool failed = false;

  explicit PieceGroup(LaneBodies<S> bodies) : body(std::move(bodies)), state(body.length()) {}

  /// Sines and cosines; the transform across each piece and the velocity it adds.
  template <class Q, class V>
  void across(Q&& q, V&& rate) {
    Transform<S> X;
    X.R.m[0] = X.R.m[4] = X.R.m[8] = broadcast<S>(1);
    Motion<S> v{};
    for (int k = 0; k < body.length(); ++k) {
      PieceState<S>& s = state[k];
      s.u = rate(k);
      if (k == 0) continue;  // its joint is the cut
      body.turn_to(k, q(k), s.turn);
      X = body.pose(k, s.turn) * X;
      v = body.seen_at_child(k, s.turn, v);
      v.ang.z += s.u;
    }
    ends.across = X;
    ends.relative = v;
  }

  void velocities() {
    Motion<S> v = ends.v_first;
    for (int k = 0; k < body.length(); ++k) {
      PieceState<S>& s = state[k];
      if (k > 0) {
        v = body.seen_at_child(k, s.turn, v);
        v.ang.z += s.u;
      }
      s.v = v;
      s.p = cross_dual(v, body[k].inertia * v);
    }
  }

  /// The recursion from the last body to the first, and what the cut system needs of it.
  void tip_to_base() {
    ArticulatedInertia<S> Y{};
    Force<S> p{};
    p -= ends.known_outboard;
    Force<S> Psi[cut_rows];
    S Lambda[15]{}, beta[cut_rows]{};
    for (int j = 0; j < cut_rows; ++j) Psi[j] = {ends.cut_columns[j].lin, ends.cut_columns[j].ang};
    failed = false;
    for (int k = body.length() - 1; k >= 0; --k) {
      PieceState<S>& s = state[k];
      add_inertia(Y, body[k].inertia);
      p += s.p;
      if (k == 0) break;
      const Force<S> U = RevoluteJoint::column(Y, 0.0);
      const S D = U.ang.z + body[k].stand_in;
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
        Psi[i] = body.seen_at_parent(k, s.turn, Psi[i]);
      }
      PlanarInertia<S> Z;
      eliminate_turn(Y, U, V, c, u, Z, p);
      s.torque = u;
      Y = body.seen_at_parent(k, s.turn, Z);
      p = body.seen_at_parent(k, s.turn, p);
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
    for (int k = 0; k < body.length(); ++k) {
      PieceState<S>& s = state[k];
      if (k > 0) {
        a = body.seen_at_child(k, s.turn, a);
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
    for (int k = body.length() - 1; k >= 0; --k) {
      PieceState<S>& s = state[k];
      w += body[k].inertia * s.v;
      w += s.p;
      s.U = w;
      if (k > 0) w = body.seen_at_parent(k, s.turn, w);
    }
  }

 private:
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
};

}  // namespace linkwise
