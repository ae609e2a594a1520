#pragma once
// The sweeps inside a group of pieces of a chain, one piece per lane, by the steps of steps.hpp.
// See dynamics/piecewise.hpp for the equations.
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
template <class S>
struct PieceEnds {
  Motion<S> v_first;
  Motion<S> cut_columns[cut_rows];  ///< X^T Q of the outboard cut joint, as rows acting on motions
  Force<S> known_outboard;          ///< wrench of the outboard cut joint's drive on the last body
  S first_torque;                   ///< tau of the inboard cut joint
};

/// What a piece answers at its cuts; see dynamics/piecewise.hpp.
template <class S>
struct PieceAnswer {
  Motion<S> JPsi[cut_rows], JQ[cut_rows], a_free;
  S QJQ[15], PsiJPsi[15], PsiJQ[25], beta[cut_rows];
  bool positive;  ///< all D are, and Y of the first body
};

/// Forces f at both cuts, which the cut system finds.
template <class S>
struct PieceForces {
  S first[cut_rows], outboard[cut_rows];
};

/// Accelerations of the first and the last body.
template <class S>
struct PieceMotion {
  Motion<S> first, last;
};

template <class S>
class PieceGroup {
 public:
  explicit PieceGroup(LaneBodies<S> bodies)
      : bodies_(std::move(bodies)), state_(bodies_.length()) {}

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
  PieceAnswer<S> eliminate_joints(Tau&& tau, const PieceEnds<S>& ends) {
    ArticulatedInertia<S> Y{};
    Force<S> p{};
    p -= ends.known_outboard;
    CutForces<S> cut{};
    for (int j = 0; j < cut_rows; ++j)
      cut.Psi[j] = {ends.cut_columns[j].lin, ends.cut_columns[j].ang};
    bool positive = true;
    for (int k = length() - 1; k >= 0; --k) {
      State& s = state_[k];
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
  PieceMotion<S> accelerate_bodies(const PieceAnswer<S>& answer, const PieceForces<S>& f,
                                   Out&& du) {
    PieceMotion<S> motion;
    Motion<S> a = answer.a_free;
    for (int j = 0; j < cut_rows; ++j) {
      a += f.first[j] * answer.JQ[j];
      a += Motion<S>{-f.outboard[j] * answer.JPsi[j].lin, -f.outboard[j] * answer.JPsi[j].ang};
    }
    motion.first = a;
    for (int k = 0; k < length(); ++k) {
      State& s = state_[k];
      if (k > 0) {
        a = bodies_.place(k, s.turn).to_child(a);
        const Motion<S> c = RevoluteJoint::bias(s.velocity, 0.0, s.rate);
        du(k, accelerate<RevoluteJoint>(s.axis, c, 0.0, a, CutTorque<S>{s.row, f.outboard}));
      }
      s.acceleration = a;
    }
    motion.last = a;
    return motion;
  }

  /// Of all joints but the cut ones.
  void calc_loads(const PieceEnds<S>& ends, const PieceForces<S>& f) {
    Force<S> w{};
    w -= ends.known_outboard;
    for (int j = 0; j < cut_rows; ++j)
      w += Force<S>{f.outboard[j] * ends.cut_columns[j].lin,
                    f.outboard[j] * ends.cut_columns[j].ang};
    for (int k = length() - 1; k >= 0; --k) {
      State& s = state_[k];
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
    S row[cut_rows];  ///< of the joint in CutForces
  };

  int length() const { return bodies_.length(); }

  /// What the first body, whose outboard side takes Y a + p, answers to forces at either cut.
  static PieceAnswer<S> answer(const ArticulatedInertia<S>& Y, const Force<S>& p,
                               const CutForces<S>& cut, const S& first_torque, bool positive) {
    PieceAnswer<S> out;
    S L[21];
    out.positive = factor(Y, L) && positive;
    Force<S> free{-p.lin, -p.ang};
    free.ang.z += first_torque;
    out.a_free = solve(L, free);
    for (int j = 0; j < cut_rows; ++j) {
      S unit[6] = {};
      unit[j] = broadcast<S>(1);
      out.JQ[j] = solve(L, to_force(unit));
      out.JPsi[j] = solve(L, cut.Psi[j]);
      out.beta[j] = cut.beta[j] + dot(out.a_free, cut.Psi[j]);
    }
    for (int i = 0; i < cut_rows; ++i)
      for (int j = 0; j < cut_rows; ++j) {
        if (j <= i) {
          out.QJQ[packed(i, j)] = to_array(out.JQ[j])[i];
          out.PsiJPsi[packed(i, j)] = cut.Lambda[packed(i, j)] + dot(out.JPsi[j], cut.Psi[i]);
        }
        out.PsiJQ[5 * i + j] = dot(out.JQ[j], cut.Psi[i]);
      }
    return out;
  }

  LaneBodies<S> bodies_;
  std::vector<State> state_;
};

}  // namespace linkwise
