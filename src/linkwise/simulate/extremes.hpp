#pragma once
// The extremes of what a simulation records, between its samples too.
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "linkwise/dynamics/batch.hpp"
#include "linkwise/simulate/applied_forces.hpp"

namespace linkwise {

/// Of one member: least and largest values of every load component, of the quantities derived from
/// loads, of positions, velocities, accelerations and drive torques, over all steps.
///
/// The end of every step is looked at. Where a parabola through neighbours says that a step may
/// hold more than what was found so far, its middle is looked at as well, and so on inward. States
/// come from the integrator; loads are those of the articulated-body method in SIMD lanes, so that
/// a look costs a fraction of an evaluation. Machines with closed loops are looked at as the
/// simulation looks at its samples. What is found depends on the steps alone.
class Extremes {
 public:
  /// Of the load of each joint, in this order: lengths of force and moment, their parts along and
  /// across the joint's axis, and the power of its drive. Joints that close loops come last.
  enum Derived { force, axial, radial, moment, tilting_moment, torque, drive_power, n_derived };

  /// The setup must outlive this. constant: torques [nv] beside the drives, or null; directions:
  /// of the joints' axes in the joint frames [n_loads][3], NaN where there is no single one.
  Extremes(const Setup& setup, const double* constant, std::span<const double> directions);

  /// How a simulation looks at a state at time t: it moves one between its own to where loops are
  /// closed, and writes accelerations du [nv], loads [n_loads][6] and drive torques [nv] as those
  /// of a sample. False: they are not known.
  struct Evaluation {
    std::function<void(double t, double* q, double* v)> close;
    std::function<bool(double t, const double* q, const double* v, double* du, double* loads,
                       double* drive)>
        evaluate;
    /// Of what was evaluated last: the power of the drive of a joint that closes a loop.
    std::function<double(int loop)> power;
  };
  /// Every step is looked at by `evaluation`, before the next one is taken.
  void evaluate_by(Evaluation evaluation) {
    evaluation_ = std::move(evaluation);
    block_ = 1;
  }

  void begin(double t, const double* q, const double* v);
  /// A step from time() to t, and the state in its middle. breaks: the system takes another course
  /// at t.
  void add_step(const double* q_middle, const double* v_middle, double t, const double* q,
                const double* v, bool breaks);
  /// Until where steps were added.
  double time() const { return time_; }

  /// Loads may have been larger by any amount between looks.
  void leave_loads_open();
  /// Before a copy is made: drops what it does not need.
  void trim();
  /// What was found until time(), see size(); the last thing asked.
  std::vector<double> found() &&;
  /// Per value, in the order [derived][joint], [joint][6], [nq], [nv] of velocities, accelerations
  /// and drive torques: the minimum, its time, a bound on what it may have been between looks, and
  /// the same of the maximum, as six rows. Then the whole load at the minimum and at the maximum
  /// of each derived quantity, [2][derived][joint][6], and the state when the force and when the
  /// moment of each joint was largest, [2][joint][state_size]. NaN where a joint has no single
  /// axis.
  static size_t size(const Model& model) {
    return 6 * width(model) + 12 * n_derived * joints(model) +
           2 * joints(model) * state_size(model);
  }
  /// Numbers of a state: [nq] and [nv] of velocities, accelerations and drive torques. None of
  /// machines with more than most_with_states joints, where they would take most of the memory.
  static size_t state_size(const Model& model) {
    return model.n_joints() > most_with_states ? 0 : motion(model);
  }
  static constexpr int most_with_states = 50;

 private:
  /// States and what was found there, row by row.
  struct Points {
    std::vector<double> t, q, v, a, values;
  };
  /// What is evaluated together.
  struct Systems {
    std::vector<double> q, v, tau, drive, given, external, du, loads, total;
    void resize(size_t n, size_t nq, size_t nv, size_t n_load);
    void repeat(size_t from, size_t to, size_t nq, size_t nv, size_t n_load);
  };
  /// The end of a step.
  struct End {
    size_t row;
    std::vector<double> middle;  ///< state in the middle of the step; empty: no step leads here
    bool apart() const { return middle.empty(); }
  };
  struct Interval {
    size_t left, middle, right;  ///< rows; the middle one was not looked at yet
    std::vector<size_t> values;  ///< that may go beyond their extremes
  };
  struct Bend {
    double a, b;
  };
  /// A value that an interval may bring beyond its extremes.
  struct Near {
    size_t value;
    double up, down;
  };
  /// All values at their extremes: when, what may have been between looks, the loads then.
  struct Extreme {
    std::vector<double> value, time, reach, wrench;
  };

  static size_t joints(const Model& model) { return static_cast<size_t>(model.n_loads()); }
  static size_t motion(const Model& model) {
    return static_cast<size_t>(model.nq()) + 3 * static_cast<size_t>(model.nv());
  }
  static size_t width(const Model& model) {
    return (n_derived + 6) * joints(model) + motion(model);
  }

  size_t append(double t, const double* q, const double* v);
  size_t append_given(size_t left, size_t right, const std::vector<double>& state);
  size_t append_middle(size_t left, size_t right);
  void evaluate(std::span<const size_t> rows);
  void evaluate_each(std::span<const size_t> rows);
  void write_values(size_t row, const double* loads, const double* drive);
  void keep(std::span<const size_t> rows);
  void keep_state(size_t value, const double* motion);
  void measure();
  void digest(bool all);
  void search_inside(std::vector<Interval> open);
  void find_near(size_t left, size_t right, std::span<const size_t> neighbours);
  void find_near(size_t left, size_t right, size_t other, const std::vector<size_t>& values);
  Bend bend_of(size_t left, size_t right, size_t other) const;
  void add_near(size_t value, double a, double b, double bulge_up, double bulge_down);
  bool is_worth_a_search() const;
  void leave_open();
  std::vector<size_t> near_values() const;
  void forget();
  template <class F>
  void for_chunks(F&& f) const;

  const Setup* setup_;
  const Model* model_;
  AppliedForces forces_;
  std::shared_ptr<BatchEvaluator> dynamics_, inverse_;
  Evaluation evaluation_;  ///< in place of these
  std::vector<double> directions_;
  size_t width_, block_;
  double time_ = 0;
  Points points_;
  Systems systems_;
  std::vector<End> ends_;
  size_t seen_ = 0, judged_ = 0;  ///< ends that were looked at, that begin an interval judged
  Extreme least_, largest_;
  std::vector<double> states_;  ///< see size()
  std::vector<double> margin_;
  std::vector<Near> near_;
};

}  // namespace linkwise
