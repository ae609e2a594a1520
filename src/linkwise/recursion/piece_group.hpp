#pragma once
// The sweeps inside a group of pieces of a chain, one piece per lane, by the steps of steps.hpp.
// See dynamics/piecewise.hpp for the equations.
#include <array>
#include <utility>
#include <vector>

#include "linkwise/recursion/lane_bodies.hpp"
#include "linkwise/recursion/steps.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

// Plain values of the pieces of a group, by which it and the cut system speak to each other.

/// What lies between the first and the last body.
template <class S>
struct PieceSpan {
  Transform<S> across;  ///< first body -> last body
  Motion<S> relative;   ///< velocity of the last body when the first one rests
};

/// What the cut joints hand in.
template <class S, int rows>
struct PieceEnds {
  Motion<S> v_first;
  Motion<S> cut_columns[rows];  ///< X^T Q of the outboard cut joint, as rows acting on motions
  Force<S> known_outboard;      ///< wrench on the last body of what is known outboard of it
  S first_torque;               ///< tau of the inboard cut joint
};

/// What a piece answers at its cuts; see dynamics/piecewise.hpp.
template <class S, int rows>
struct PieceResponse {
  Motion<S> JPsi[rows], JQ[cut_rows], a_free;
  S QJQ[15], PsiJPsi[rows * (rows + 1) / 2], PsiJQ[rows * cut_rows], beta[rows];
  CutForces<S, rows> cut;  ///< at the first body
};
template <class S, int rows>
struct PieceAnswer {
  PieceResponse<S, rows> response;
  bool positive;  ///< all D are, and Y of the first body
};

/// Forces f at both cuts, which the cut system finds.
template <class S, int rows>
struct PieceForces {
  S first[cut_rows], outboard[rows];
};

/// Accelerations of the first and the last body.
template <class S>
struct PieceMotion {
  Motion<S> first, last;
};

/// rows: of forces at the outboard cut, see CutForces.
template <class S, int rows>
class PieceGroup {
 public:
  using Ends = PieceEnds<S, rows>;
  using Answer = PieceAnswer<S, rows>;
  using Forces = PieceForces<S, rows>;

  /// last: position of the last body of each lane's piece; fillers follow it.
  PieceGroup(LaneBodies<S> bodies, const std::array<int, lane_count<S>>& last)
      : bodies_(std::move(bodies)), last_(last), state_(bodies_.length()) {
    for (const int k : last_) state_[k].is_last = true;
  }

  void add_wrench(int k, int l, const Force<double>& p) { add_lanes<S>(state_[k].bias, l, p); }
  Force<double> joint_load(int k, int l) const {
    return get_lanes<Force<double>, S>(state_[k].joint_load, l);
  }

  /// Sines and cosines; the transform across each piece and the velocity it adds.
  template <class Q, class V>
  PieceSpan<S> across(Q&& q, V&& rate) {
    Transform<S> X;
    X.R.m[0] = X.R.m[4] = X.R.m[8] = broadcast<S>(1);
    Motion<S> v{};
    for (int k = 0; k < length(); ++k) {
      State& s = state_[k];
      s.rate = rate(k);
      if (k == 0) continue;  // its joint is the cut
      bodies_.turn_to(k, q(k), s.turn);
      const auto place = bodies_.place(k, s.turn);
      X = place.pose() * X;
      v = outward_velocity<RevoluteJoint>(place, v, 0.0, s.rate);
    }
    return {X, v};
  }

  void calc_velocities(Motion<S> v) {
    for (int k = 0; k < length(); ++k) {
      State& s = state_[k];
      if (k > 0) v = outward_velocity<RevoluteJoint>(bodies_.place(k, s.turn), v, 0.0, s.rate);
      s.velocity = v;
      s.bias = momentum_bias(bodies_[k].body, v);
    }
  }

  /// The recursion from the last body to the first, and what the cut system needs of it.
  template <class Tau>
  Answer eliminate_joints(Tau&& tau, const Ends& ends) {
    ArticulatedInertia<S> Y{};
    Force<S> p{};
    CutForces<S, rows> cut{};
    bool positive = true;
    for (int k = length() - 1; k >= 0; --k) {
      State& s = state_[k];
      if (s.is_last) {
        p -= at_last(k, ends.known_outboard);
        for (int j = 0; j < rows; ++j) {
          const Motion<S> column = at_last(k, ends.cut_columns[j]);
          cut.Psi[j] += Force<S>{column.lin, column.ang};
        }
      }
      add_inertia(Y, bodies_[k].body);
      p += s.bias;
      if (k == 0) break;
      EliminatedAxis<S> axis;
      positive &=
          is_positive(eliminate<RevoluteJoint>(Y, p, 0.0, bodies_[k].stand_in, S(tau(k)), axis));
      s.axis = axis;
      const Motion<S> c = RevoluteJoint::bias(s.velocity, 0.0, s.rate);
      const auto place = bodies_.place(k, s.turn);
      carry_cut_forces(place, axis, c, cut, s.row);
      PlanarInertia<S> Ya;
      reduce<RevoluteJoint>(Y, axis, c, Ya, p);
      Y = place.to_parent(Ya);
      p = place.to_parent(p);
    }
    return answer(Y, p, cut, ends.first_torque, positive);
  }

  template <class Out>
  PieceMotion<S> accelerate_bodies(const Answer& answer, const Forces& f, Out&& du) {
    const PieceResponse<S, rows>& of = answer.response;
    PieceMotion<S> motion;
    Motion<S> a = of.a_free;
    for (int j = 0; j < cut_rows; ++j) a += f.first[j] * of.JQ[j];
    for (int j = 0; j < rows; ++j) a += -f.outboard[j] * of.JPsi[j];
    motion.first = a;
    for (int k = 0; k < length(); ++k) {
      State& s = state_[k];
      if (k > 0) {
        a = bodies_.place(k, s.turn).to_child(a);
        const Motion<S> c = RevoluteJoint::bias(s.velocity, 0.0, s.rate);
        du(k, accelerate<RevoluteJoint>(s.axis, c, 0.0, a, CutTorque<S, rows>{s.row, f.outboard}));
      }
      s.acceleration = a;
    }
    motion.last = a;
    return motion;
  }

  /// Of all joints but the cut ones.
  void calc_loads(const Ends& ends, const Forces& f) {
    Force<S> outboard{};
    outboard -= ends.known_outboard;
    for (int j = 0; j < rows; ++j) {
      const Motion<S>& column = ends.cut_columns[j];
      outboard += f.outboard[j] * Force<S>{column.lin, column.ang};
    }
    Force<S> w{};
    for (int k = length() - 1; k >= 0; --k) {
      State& s = state_[k];
      if (s.is_last) w += at_last(k, outboard);
      inward_load(bodies_[k].body, s.acceleration, s.bias, w);
      s.joint_load = w;
      if (k > 0) w = bodies_.place(k, s.turn).to_parent(w);
    }
  }

 private:
  struct State {
    LaneTurn<S> turn;
    S rate;
    Motion<S> velocity, acceleration;
    Force<S> bias, joint_load;
    EliminatedAxis<S> axis;
    S row[rows];           ///< of the joint in CutForces
    bool is_last = false;  ///< of some lane's piece
  };

  int length() const { return bodies_.length(); }

  /// x in the lanes whose piece ends at position k, else zero.
  template <class X>
  X at_last(int k, const X& x) const {
    X out{};
    for (int l = 0; l < lane_count<S>; ++l)
      if (last_[l] == k) add_lanes<S>(out, l, x, l);
    return out;
  }

  /// What the first body, whose outboard side takes Y a + p, answers to forces at either cut.
  static Answer answer(const ArticulatedInertia<S>& Y, const Force<S>& p,
                       const CutForces<S, rows>& cut, const S& first_torque, bool positive) {
    Answer whole;
    PieceResponse<S, rows>& out = whole.response;
    S L[21];
    whole.positive = factor(Y, L) && positive;
    out.cut = cut;
    Force<S> free{-p.lin, -p.ang};
    free.ang.z += first_torque;
    out.a_free = solve(L, free);
    for (int j = 0; j < cut_rows; ++j) {
      S unit[6] = {};
      unit[j] = broadcast<S>(1);
      out.JQ[j] = solve(L, to_force(unit));
      for (int i = 0; i <= j; ++i) out.QJQ[packed(j, i)] = to_array(out.JQ[j])[i];
      for (int i = 0; i < rows; ++i) out.PsiJQ[cut_rows * i + j] = dot(out.JQ[j], cut.Psi[i]);
    }
    for (int j = 0; j < rows; ++j) {
      out.JPsi[j] = solve(L, cut.Psi[j]);
      out.beta[j] = cut.beta[j] + dot(out.a_free, cut.Psi[j]);
      for (int i = 0; i <= j; ++i)
        out.PsiJPsi[packed(j, i)] = cut.Lambda[packed(j, i)] + dot(out.JPsi[j], cut.Psi[i]);
    }
    return whole;
  }

  LaneBodies<S> bodies_;
  std::array<int, lane_count<S>> last_;
  std::vector<State> state_;
};

}  // namespace linkwise
