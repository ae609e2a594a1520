#pragma once
// The sweeps inside a group of pieces of a chain, one piece per lane, by the steps of steps.hpp.
// See dynamics/piecewise.hpp for the equations.
#include <utility>
#include <vector>

#include "linkwise/recursion/lane_bodies.hpp"
#include "linkwise/recursion/steps.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

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
  // Results of the cut system.
  S f_first[cut_rows], f_outboard[cut_rows];
  Motion<S> a_first, a_last;
};

template <class S>
class PieceGroup {
 public:
  PieceEnds<S> ends;
  bool failed = false;

  explicit PieceGroup(LaneBodies<S> bodies)
      : bodies_(std::move(bodies)), state_(bodies_.length()) {}

  void add_wrench(int k, int l, const Force<double>& p) { add_lanes<S>(state_[k].bias, l, p); }
  Force<double> joint_load(int k, int l) const {
    return get_lanes<Force<double>, S>(state_[k].joint_load, l);
  }

  /// Sines and cosines; the transform across each piece and the velocity it adds.
  template <class Q, class V>
  void across(Q&& q, V&& rate) {
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
    ends.across = X;
    ends.relative = v;
  }

  void calc_velocities() {
    Motion<S> v = ends.v_first;
    for (int k = 0; k < length(); ++k) {
      State& s = state_[k];
      if (k > 0) v = outward_velocity<RevoluteJoint>(bodies_.place(k, s.turn), v, 0.0, s.rate);
      s.velocity = v;
      s.bias = momentum_bias(bodies_[k].inertia, v);
    }
  }

  /// The recursion from the last body to the first, and what the cut system needs of it.
  template <class Tau>
  void eliminate_joints(Tau&& tau) {
    ArticulatedInertia<S> Y{};
    Force<S> p{};
    p -= ends.known_outboard;
    CutForces<S> cut{};
    for (int j = 0; j < cut_rows; ++j)
      cut.Psi[j] = {ends.cut_columns[j].lin, ends.cut_columns[j].ang};
    failed = false;
    for (int k = length() - 1; k >= 0; --k) {
      State& s = state_[k];
      add_inertia(Y, bodies_[k].inertia);
      p += s.bias;
      if (k == 0) break;
      EliminatedAxis<S> axis;
      failed |=
          !is_positive(eliminate<RevoluteJoint>(Y, p, 0.0, bodies_[k].stand_in, S(tau(k)), axis));
      s.axis = axis;
      const Motion<S> c = RevoluteJoint::bias(s.velocity, 0.0, s.rate);
      const auto place = bodies_.place(k, s.turn);
      carry_cut_forces(place, axis, c, cut, s.row);
      PlanarInertia<S> Ya;
      reduce<RevoluteJoint>(Y, axis, c, Ya, p);
      Y = place.to_parent(Ya);
      p = place.to_parent(p);
    }
    calc_answers(Y, p, cut);
  }

  /// Accelerations, then the loads of all joints but the cut ones when `loads`.
  template <class Out>
  void accelerate_bodies(Out&& du, bool loads) {
    Motion<S> a = ends.a_free;
    for (int j = 0; j < cut_rows; ++j) {
      a += Motion<S>{ends.f_first[j] * ends.JQ[j].lin, ends.f_first[j] * ends.JQ[j].ang};
      a +=
          Motion<S>{-ends.f_outboard[j] * ends.JPsi[j].lin, -ends.f_outboard[j] * ends.JPsi[j].ang};
    }
    ends.a_first = a;
    for (int k = 0; k < length(); ++k) {
      State& s = state_[k];
      if (k > 0) {
        a = bodies_.place(k, s.turn).to_child(a);
        const Motion<S> c = RevoluteJoint::bias(s.velocity, 0.0, s.rate);
        du(k, accelerate<RevoluteJoint>(s.axis, c, 0.0, a, CutTorque<S>{s.row, ends.f_outboard}));
      }
      s.acceleration = a;
    }
    ends.a_last = a;
    if (loads) calc_loads();
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

  void calc_loads() {
    Force<S> w{};
    w -= ends.known_outboard;
    for (int j = 0; j < cut_rows; ++j)
      w += Force<S>{ends.f_outboard[j] * ends.cut_columns[j].lin,
                    ends.f_outboard[j] * ends.cut_columns[j].ang};
    for (int k = length() - 1; k >= 0; --k) {
      State& s = state_[k];
      inward_load(bodies_[k].inertia, s.acceleration, s.bias, w);
      s.joint_load = w;
      if (k > 0) w = bodies_.place(k, s.turn).to_parent(w);
    }
  }

  /// What the first body, whose outboard side takes Y a + p, answers to forces at either cut.
  void calc_answers(const ArticulatedInertia<S>& Y, const Force<S>& p, const CutForces<S>& cut) {
    S L[21];
    failed |= !factor(Y, L);
    Force<S> free{-p.lin, -p.ang};
    free.ang.z += ends.first_torque;
    ends.a_free = solve(L, free);
    for (int j = 0; j < cut_rows; ++j) {
      S unit[6] = {};
      unit[j] = broadcast<S>(1);
      ends.JQ[j] = solve(L, to_force(unit));
      ends.JPsi[j] = solve(L, cut.Psi[j]);
      ends.beta[j] = cut.beta[j] + dot(ends.a_free, cut.Psi[j]);
    }
    for (int i = 0; i < cut_rows; ++i)
      for (int j = 0; j < cut_rows; ++j) {
        if (j <= i) {
          ends.QJQ[packed(i, j)] = to_array(ends.JQ[j])[i];
          ends.PsiJPsi[packed(i, j)] = cut.Lambda[packed(i, j)] + dot(ends.JPsi[j], cut.Psi[i]);
        }
        ends.PsiJQ[5 * i + j] = dot(ends.JQ[j], cut.Psi[i]);
      }
  }

  LaneBodies<S> bodies_;
  std::vector<State> state_;
};

}  // namespace linkwise
