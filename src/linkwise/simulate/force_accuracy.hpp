#pragma once
// How well a state must be known for the forces that it makes.
//
// Springs, PD drives, dampers, friction and stops turn an error of a coordinate or rate into a
// force, by their gain g. What the integrator's error test lets pass, w, is then an error g w of
// the force. Where that exceeds a share of the largest force f that the degree of freedom has met,
// the test becomes as much stricter:
//     w <= share f / g.
// A joint that comes with speed s upon a stop of stiffness k and damping d has not met its force
// yet. With m = 1 / (H^-1)_ii, the inertia that the stop feels, it will be about
//     f = s sqrt(k (1 + d s) m).
// For the step that touches the stop to be tested by it, steps end halfway to the stop at most,
// until the contact is a few of its own times sqrt(m / (k (1 + d s))) away. Steps that meet a stop
// in spite of that are taken again up to it, and those that have passed through it and come back,
// up to where they are deepest.
// What closes loops has no error of its own. Those of the tree make it, w_l^2 = sum (z_i w_i)^2
// with the slopes of LoopWatch, and all of these are lowered together. What loops hold is not
// watched. They hold it everywhere or in single positions, such as the slider of a crank in its
// dead centre, so this is looked at after one step, two, four and so on, until it has moved.
#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "linkwise/dynamics/mobility.hpp"
#include "linkwise/simulate/force_gains.hpp"
#include "linkwise/simulate/loop_watch.hpp"

namespace linkwise {

class ForceAccuracy {
 public:
  /// Both must outlive this. loops: null where no row closes one.
  ForceAccuracy(const Setup& setup, std::vector<GainRow> rows, LoopWatch* loops);

  bool started() const { return started_; }
  /// Whether accelerations of what closes loops matter next.
  bool asks_accelerations() const { return stops_close_ || !started_; }

  /// A state as the integrator has it: coordinates, and rates in parent axes, their derivatives and
  /// the joints' torques, those of LoopWatch where there is one; the scale of
  /// OdeSystem::error_scale [nq + nv].
  struct State {
    const double *q, *v, *dv, *tau, *scale;
    /// As FreeMotion::evaluate() takes them; null: no loops.
    const double *closed_q = nullptr, *loop_q = nullptr;
  };
  /// Both at the end of a step and before the first one.
  void accepted(double t, const State& state);

  /// The latest end of a step that begins at t; infinite unless t is the time accepted last.
  double step_limit(double t) const {
    return t == time_ ? std::min(step_limit_, t < retake_until_ ? retake_until_ : infinity)
                      : infinity;
  }
  /// Whether a step from the state accepted last to q, v is to be taken again with the step limit
  /// that holds from now on. state(t, y): see OdeSystem::retakes; y as State has it.
  bool passes_stop(double begin, double end, const double* q, const double* v,
                   const std::function<void(double, double*)>& state);
  /// Whether a stop has begun or ceased to push in the step accepted last.
  bool has_jumped() const { return has_jumped_; }
  /// Lowers the allowed errors [nq + nv] where forces ask for it. q, v: of the tree.
  void limit_errors(const double* q, const double* v, double* allowed) const;

  /// One line with the remedy where forces are not known well in spite of it; else empty.
  std::string doubt() const;

 private:
  struct Row : GainRow {
    Contact last{};          ///< at the time accepted last
    double usual_error = 0;  ///< of the coordinate, then
    double inertia = 0;      ///< that the stop feels, once it is near
    double at_start = 0;     ///< the same, at the start
    bool near = false;       ///< a stop is in reach of the next step
    bool held = false;       ///< by loops, wherever it was looked at
    double largest = 0;      ///< force met so far
    double error = 0;        ///< largest that the error test let pass of a force
    double error_time = 0, error_of_rounding = 0;
  };
  struct Gains {
    double position = 0, rate = 0;
    double bend = infinity;  ///< change of the rate that may turn a stop's damping off
    double coming = 0;       ///< the force of a blow that is on its way
  };

  Contact contact(const Row& row, const double* q, const double* v) const;
  Gains gains(const Row& row, const double* q, const double* v, bool ahead) const;
  void find_held(const State& state);
  void approach(Row& row, double t, const State& state);
  double meets_stop(const Row& row, double begin, double end, const Contact& after,
                    const std::function<Contact(double)>& at) const;
  static bool pushes(const Row& row, const Contact& at);
  bool may_meet(const Row& row, double h, const Contact& after) const;
  bool is_resolved(const Row& row, double speed, double error) const;
  void limit_slopes(const Row& row, const State& state);
  double error_of_slopes(const Row& row, bool of_rate,
                         const std::function<double(int)>& error) const;
  void measure(Row& row, double t, const State& state) const;
  double usual_error(const State& state, int i) const;
  double usual_position_error(const Row& row, const State& state) const;
  double inertia(const Row& row, const double* q);

  const Setup& setup_;
  LoopWatch* loops_;
  int nq_, nv_;                 ///< of the tree
  bool stops_close_ = false;    ///< a row with a stop closes a loop
  std::vector<double> limits_;  ///< of each number of y, for what closes loops; none: no such row
  std::unique_ptr<FreeMotion> free_;    ///< null: no loops, or none of the rows is held
  std::unique_ptr<Mobility> mobility_;  ///< made when first needed
  std::vector<double> mobilities_;      ///< at the state at hand; empty: not computed
  std::vector<Row> rows_;
  double relative_, absolute_;
  double time_ = 0, last_step_ = 0, step_limit_ = infinity;
  double retake_until_ = -infinity;
  std::vector<double> sampled_;  ///< a state within a step
  int steps_ = 0, held_due_ = 0, retakes_ = 0;
  bool started_ = false, has_jumped_ = false;
};

}  // namespace linkwise
