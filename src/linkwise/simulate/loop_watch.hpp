#pragma once
// What closes loops, as tests of forces see it: its coordinates and rates stand behind those of the
// tree, from which they follow. The rate of a loop joint is
//     u_l = sum_k z_k v_k,   z_k = P_k . F_k,
// with F_k the wrench P^+T of the loop joint where joint k of a path passes it on. An error of
// coordinate k is one of q_l, z_k times as large, and also one of u_l, because it turns what moves.
#include <functional>
#include <span>
#include <vector>

#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/kinematics/body_columns.hpp"
#include "linkwise/simulate/free_motion.hpp"
#include "linkwise/simulate/loop_forces.hpp"

namespace linkwise {

class LoopWatch {
 public:
  /// to_state(t, y) makes a state of the tree, with what is given at time t, of an integrator's y.
  /// Setup and forces must outlive this.
  LoopWatch(const Setup& setup, LoopForces& forces, std::function<void(double, double*)> to_state);

  /// Coordinates and rates of the tree as y has them, then those of loop joints. Linear rates are
  /// along the axes of the previous frame.
  void update(double t, const double* y);
  const double* q() const { return q_.data(); }
  const double* v() const { return v_.data(); }
  /// The derivative of v() at y, and torques: of the tree, `tau`, then those of loop joints as they
  /// were evaluated last. Without `loops_too` the derivatives of their rates count as zero.
  void accelerate(double t, const double* y, const double* ydot, const double* tau,
                  bool loops_too = true);
  const double* dv() const { return dv_.data(); }
  const double* tau() const { return tau_.data(); }
  int nq() const { return nq_ + tree_.loops.nq; }
  int nv() const { return nv_ + tree_.loops.nv; }

  /// What an error of one number of y does to a coordinate and a rate: bounds of both slopes.
  struct Slope {
    int of;  ///< place in y
    double position, rate;
  };
  /// At the y that was asked for last. rate: a place in v(), of a loop joint.
  std::span<const Slope> slopes(int rate) {
    if (!known_) find_slopes();
    return slopes_[rate - nv_];
  }
  /// 1 / (z^T H_c^-1 z) there, what a force along it has to move; 0 where nothing moves.
  double inertia(int rate);
  /// Whether it moves where the tree moves so.
  bool moves(int rate, const FreeMotion& free);

 private:
  struct Along {
    int dof;
    double z, size;  ///< size: that z could have
    double turn;     ///< of the rate, by an error of the coordinate
  };

  void find_slopes();
  void find_along(int loop, const Element& element, int k, std::vector<Along>& out) const;
  void pass_on(const std::vector<int>& path, Force<double> F, double of_turns, double of_shifts,
               std::vector<Along>& out) const;
  void add_slopes(const Element& element, std::vector<Slope>& out) const;

  const Model& tree_;
  LoopForces& forces_;
  std::function<void(double, double*)> to_state_;
  int nq_, nv_;
  std::vector<double> state_, q_, v_, dv_, tau_;
  BodyColumns columns_;
  std::vector<const Element*> element_of_;  ///< by degree of freedom of the tree
  std::vector<Along> at_;                   ///< the same, of the rate at hand
  std::vector<std::vector<Along>> along_;   ///< by rate
  std::vector<std::vector<Slope>> slopes_;
  bool known_ = false;  ///< along_ and slopes_, at state_
  ArticulatedLoops kernel_;
};

}  // namespace linkwise
