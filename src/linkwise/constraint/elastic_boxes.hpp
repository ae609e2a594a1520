#pragma once
// Bodies with coordinates of their own as A f = b sees them: the motions of two frames, the body's
// own and the one on its port, under wrenches on either,
//     [ a      ]     [ w      ]   [ Y^-1 (-M_e m_e^-1 h)             ]
//     [ a_port ] = C [ w_port ] + [ Xhat (the same) + P m_e^-1 h + c ],     h = tau - p_e
// with the coordinates eliminated (recursion/own_steps.hpp):
//     Y = M - M_e m_e^-1 M_e^T,   Xhat = X - P m_e^-1 M_e^T,
//     C = [ Y^-1, Y^-1 Xhat^T; Xhat Y^-1, Xhat Y^-1 Xhat^T + P m_e^-1 P^T ].
// Wrenches include -p on the frame. Formulas: docs/theory/flexible.md.
#include <vector>

#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

class ElasticBoxes {
 public:
  explicit ElasticBoxes(const Model& model);

  bool has(int body) const { return !place_.empty() && place_[body] >= 0; }
  int count(int body) const { return at(body).n; }  ///< of its coordinates
  /// The body on its port, or -1.
  int carried_by(int body) const { return at(body).carried; }

  /// At the state at hand; C into `compliance`, 12 x 12, full. False where the body has no
  /// acceleration: its inertia or that of its coordinates is not positive definite.
  bool update(const SweepInput<double>& in, int body, const std::vector<BodyState<double>>& states,
              double* compliance);
  /// Forces h on the coordinates: tau - p_e of the state, with c; or given, without.
  void set_forces(const SweepInput<double>& in, int body);
  void set_forces(int body, const double* h);

  /// a [12] of the wrenches w [12], and the accelerations of the coordinates.
  void accelerate(int body, const double* compliance, const double* w, double* a);
  const double* accelerations(int body) const { return at(body).numbers.du; }

  /// M a + M_e du.
  Force<double> inertia_times(int body, const Motion<double>& a, const double* du) const;
  /// What of tau - p_e the accelerations leave, w_port on the port: tau [n] into `left`.
  void calc_forces_missed(const SweepInput<double>& in, int body, const Motion<double>& a,
                          const double* du, const Force<double>& w_port, double* left) const;
  /// Adds what rates du of the coordinates give to the port.
  void add_port_rate(int body, const double* du, Motion<double>& a) const;

 private:
  /// Places in numbers_ and columns_.
  struct Numbers {
    double *m_e, *factor, *p_e, *h, *y, *du;  ///< y = m_e^-1 h
  };
  struct Box {
    int n, carried = -1;
    ArticulatedInertia<double> M;
    Motion<double> c;
    Force<double>* M_e = nullptr;
    Motion<double>* P = nullptr;
    Numbers numbers{};
    Force<double> push;         ///< -M_e y
    Motion<double> port_alone;  ///< P y + c
  };
  Box& at(int body) { return boxes_[place_[body]]; }
  const Box& at(int body) const { return boxes_[place_[body]]; }
  void push_by_forces(Box& box, const Motion<double>& c);

  const Model& model_;
  std::vector<int> place_;  ///< by body, -1: it has no coordinates; empty: none has
  std::vector<Box> boxes_;
  std::vector<double> numbers_;
  std::vector<Force<double>> columns_;
  std::vector<Motion<double>> port_columns_;
};

}  // namespace linkwise
