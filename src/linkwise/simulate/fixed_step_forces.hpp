#pragma once
// How well fixed steps resolve the forces of springs, PD drives, dampers, friction and stops.
//
// A fixed step has no error test. What a step of length h does to a rate v and a coordinate q is
// compared with the trapezoidal rule and with the cubic through both ends,
//     dv = v1 - v0 - h/2 (a0 + a1),   dq = q1 - q0 - h/2 (v0 + v1) + h^2/12 (a1 - a0).
// The gains turn the difference into a force: at once into F(q1 + dq, v1 + dv) - F(q1, v1), and
// where a spring or stop of stiffness k brings the inertia m = 1 / (H^-1)_ii to rest, into
// sqrt(k m) dv. The rule is coarser than the methods, so that it sees what they do not resolve
// before it hurts, and says nothing where they do.
// A stop that begins to push within a step acts from some time of it on, which methods do not know.
// A blow of speed s with K = k (1 + d s) is wrong by some K h^2 / m of its force s sqrt(K m). Stops
// that are passed through and left within a step are found on the cubic.
#include <memory>
#include <string>
#include <vector>

#include "linkwise/dynamics/mobility.hpp"
#include "linkwise/simulate/force_gains.hpp"
#include "linkwise/simulate/loop_watch.hpp"

namespace linkwise {

/// Of one member.
class FixedStepForces {
 public:
  /// Both must outlive this. loops: null where no row closes one.
  FixedStepForces(const Setup& setup, const std::vector<GainRow>& rows, LoopWatch* loops);

  /// Whether nothing was evaluated since a step ended, or the start.
  bool begins_step() const { return fresh_; }

  /// Coordinates, and rates in parent axes: those of LoopWatch where there is one.
  void start(double t, const double* q, const double* v);
  /// After each evaluation, or the first one of each step: dv of v, and the joints' torques.
  void evaluated(double t, const double* dv, const double* tau);
  /// At the end of each step; breaks: what acts jumps there.
  void accepted(double t, const double* q, const double* v, bool breaks);

  /// The force that is known worst, where it is not known well; else without a row.
  ForceDoubt worst() const;
  /// One line with the remedy.
  static std::string text(const Model& model, const ForceDoubt& doubt);

 private:
  struct Row : GainRow {
    double inertia = 0;  ///< that a blow feels; 0: not known yet
    double largest = 0;  ///< force met so far
    double error = 0, time = 0;
    double steepness = 0;  ///< h sqrt(K / m) then
  };
  struct Point {
    double t = 0;
    std::vector<double> q, v, dv, tau;
    bool known = false;  ///< dv and tau
  };

  void judge_step();
  void judge(Row& row, double h);
  double meet(const Row& row, double h, double& made, double& K) const;
  double of_blow(const Row& row, double speed, double h, double inertia) const;
  double inertia(const Row& row);

  const Setup& setup_;
  LoopWatch* loops_;
  int nq_, nv_;
  bool first_order_;
  std::unique_ptr<Mobility> mobility_;  ///< made when first needed
  std::vector<double> mobilities_;      ///< at the end of the step; empty: not computed
  std::vector<Row> rows_;
  Point begin_, end_;
  bool fresh_ = true;      ///< nothing was evaluated since the step was accepted
  bool complete_ = false;  ///< the step that ends at `end_` was looked at
  bool breaks_ = false;    ///< at end_
  double evaluated_at_ = 0;
  std::vector<double> dv_, tau_;  ///< of the last evaluation
};

}  // namespace linkwise
