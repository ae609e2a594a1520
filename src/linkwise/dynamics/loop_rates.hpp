#pragma once
// Rates u_l = R u of the joints that close loops, as the tree's rates make them, and what torques
// along them are for the tree, R^T tau_l. Rotors on them add R^T I R to the mass matrix of the
// tree: u^T (H + R^T I R) u / 2 is the kinetic energy of bodies and rotors together.
#include <span>
#include <vector>

#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/kinematics/loop_states.hpp"

namespace linkwise {

class LoopRates {
 public:
  /// The model must outlive it.
  explicit LoopRates(const Model& model);

  /// R u of all loop joints [nv of theirs], 0 of those of given motion. u [nv] of the tree.
  std::span<const double> rates(const double* q, const double* u);
  /// Accelerations of all loop joints [nv of theirs] that du [nv] of the tree at rates u makes.
  std::span<const double> accelerations(const double* q, const double* u, const double* du);
  /// torque [nv] += R^T tau_l, tau_l [nv of loop joints], at the q of the last rates().
  void add_torques(const double* q, const double* tau_l, double* torque);

  bool any_rotors() const { return any_rotors_; }
  /// y += R^T I R x at q; both [nv].
  void add_rotors(const double* q, const double* x, double* y);
  /// H += R^T I R [nv][nv]; rows and columns of prescribed degrees of freedom stay.
  void add_rotors_to(const double* q, double* H);

 private:
  const Model& model_;
  const std::vector<double>& armature_;
  bool any_rotors_;
  LoopStates states_;
  InverseDynamics<double> tree_;
  std::vector<int> frame_;  ///< by body: the user's joint whose frame takes wrenches on it
  std::vector<double> external_, torque_, tau_l_, du_l_, x_, y_;
};

}  // namespace linkwise
