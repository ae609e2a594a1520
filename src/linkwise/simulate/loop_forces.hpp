#pragma once
// What acts on the joints that close loops: their drives, springs, dampers and stops, along
// coordinates that follow from those of the tree; and their given motions.
#include <vector>

#include "linkwise/kinematics/loop_states.hpp"
#include "linkwise/simulate/setup.hpp"

namespace linkwise {

class LoopForces {
 public:
  /// The setup must outlive this.
  explicit LoopForces(const Setup& setup);

  /// Fixes where locked joints stand: where q [nq] of the tree has them.
  void hold(const double* q);
  /// Given motions at time t, for what takes states of the tree alone.
  void give(double t);
  /// Coordinates of given motions and, of the other joints, where they were accepted last; null
  /// where only what acts along the joints asks for turns, so that the equations of motion take
  /// angles that are small.
  const double* near_q() const { return turns_matter_ ? near_q_.data() : nullptr; }
  const double* given_v() const { return given_v_.data(); }
  /// Writes them into an input.
  void give_to(SweepInput<double>& in) const;

  /// At a state of the tree. Turns are counted from the last accepted state on.
  void evaluate(double t, const double* q, const double* v);
  /// The same without forces, whose functions may be the caller's.
  void update(double t, const double* q, const double* v);
  void accepted(double t, const double* q, const double* v);
  /// InputError where a spring of the state seen last has a force and no direction.
  void require_directions() const;

  const double* tau() const { return tau_.data(); }      ///< [nv] of loop joints
  const double* drive() const { return drive_.data(); }  ///< the drives' share
  const double* q() const { return states_.q().data(); }
  const double* v() const { return states_.v().data(); }
  const LoopStates& states() const { return states_; }
  /// The drive torques of joints of given motion, from loads [n_loads][6] of the machine.
  void add_holding_torques(const double* loads);
  /// Takes out of them what a coupling puts into a joint.
  void take_coupling_torque(int v, double torque) { drive_[v] -= torque; }
  /// Power that damping, friction and the damping of stops take away.
  double dissipated() const;

 private:
  const Setup& setup_;
  const LoopJoints& loops_;
  LoopStates states_;
  bool passive_, turns_matter_ = false;
  std::vector<double> near_q_, given_v_, given_du_, tau_, drive_;
};

/// What a joint's load [6] is along its coordinates, into tau at the joint's degrees of freedom.
void torques_of_load(const JointInfo& joint, const std::vector<Element>& elements, const double* q,
                     const double* load, double* tau);

}  // namespace linkwise
