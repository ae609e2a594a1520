#pragma once
// The time loop: drives, dynamics and integrator, sampled at the times asked for. Free of Python
// apart from user callables. One simulation has one member, or several that differ in their initial
// states and share SIMD lanes and fixed steps.
#include <algorithm>
#include <functional>
#include <memory>
#include <optional>

#include "linkwise/dynamics/assembly.hpp"
#include "linkwise/dynamics/batch.hpp"
#include "linkwise/dynamics/loop_projection.hpp"
#include "linkwise/simulate/applied_forces.hpp"
#include "linkwise/simulate/coasting.hpp"
#include "linkwise/simulate/force_watch.hpp"
#include "linkwise/simulate/kept_extremes.hpp"
#include "linkwise/simulate/parent_axes.hpp"
#include "linkwise/simulate/quantity.hpp"
#include "linkwise/simulate/setup.hpp"
#include "linkwise/simulate/solver_tolerance.hpp"
#include "linkwise/simulate/step_limits.hpp"
#include "linkwise/simulate/work.hpp"

namespace linkwise {

/// Looks on at the evaluations that the integrator asks for, of one member.
class EvaluationObserver {
 public:
  virtual ~EvaluationObserver() = default;
  virtual void started() = 0;
  /// Makes the evaluation at time t and returns what it reports.
  virtual DynamicsReport evaluate(double t, const std::function<DynamicsReport()>& evaluation) = 0;
  /// The step that the last evaluation ended is accepted.
  virtual void accepted() = 0;
};

/// Initial states with a row per member.
struct Start {
  const double *q = nullptr, *v = nullptr;
  const double* tau = nullptr;  ///< constant, beside the drives; null: none
  size_t members = 1;
  /// Joints that closing loops leaves where they are, as long as it can: see assemble().
  std::vector<std::string> hold = {};
  /// Rates of joints that close loops, which those of the tree follow.
  std::vector<LoopRate> loop_rates = {};
};

class BodyVelocityState;
class StiffPart;

class Simulation : private OdeSystem {
 public:
  Simulation(std::shared_ptr<const Model> model, SimulationOptions options);
  /// Of the same machine, drives and options, which must not change any more.
  explicit Simulation(std::shared_ptr<Setup> setup);
  ~Simulation();

  void set_drive(int joint, Drive drive) { setup_->set_drive(joint, std::move(drive)); }
  void add_wrench(Wrench wrench) { setup_->add_wrench(std::move(wrench)); }

  /// Fixes the drives and starts at t0. Rates of locked joints must be zero; the state of joints
  /// with a motion drive is that of the motion, whatever the start says. One member is computed by
  /// the method of the options, several share lanes: see check_members().
  void start(double t0, const Start& start);

  /// Steps until t is covered, then writes the sample there, NaN for members that have ended. False
  /// when all have: see ending(). Works are known where the first sample after the start asks for
  /// one, else NaN.
  bool advance(double t, const Sample& sample);

  /// From the next start on, keeps the extremes between samples; directions: those of Extremes.
  void keep_extremes(std::vector<double> directions) { directions_ = std::move(directions); }
  const std::vector<double>& directions() const { return directions_; }
  bool keeps_extremes() const { return extremes_.has_value(); }
  /// Of one member until the last time that was advanced to, Extremes::size() numbers.
  std::vector<double> extremes(size_t member = 0);

  const Ending& ending(size_t member = 0) const { return endings_[member]; }
  SimulationStatistics statistics() const;
  /// As Integrator::stiffness().
  std::string stiffness() const { return integrator_ ? integrator_->stiffness() : std::string(); }
  /// One line where forces of large gain are not known well, with the remedy; else empty.
  std::string force_doubt(size_t member = 0) const { return watch_->doubt(member); }
  /// With fixed steps: how much of the largest force that is; 0 where they are known well.
  double force_error(size_t member) const { return watch_->error(member); }
  /// Where loads of closed loops have no bound, one line; empty: nowhere.
  std::string loop_doubt() const;
  /// Whether works were found, where they were asked for.
  bool knows_works() const { return !work_ || work_->known(); }
  /// Ends what still runs.
  void stop(Outcome outcome) { end_all({outcome, integrator_->time(), "", describe(outcome)}); }

  /// Asked at every step: once it is true, the run stops with the outcome `interrupted`.
  void set_interrupt(std::function<bool()> interrupted) { interrupted_ = std::move(interrupted); }

  /// From the next start on; null: nobody. It must outlive the simulation's use.
  void set_observer(EvaluationObserver* observer) { observer_ = observer; }
  /// What closing the loops changed at the start, one line; empty: nothing.
  const std::string& assembled() const { return assembled_; }
  /// The state of one member that it started from, [nq + nv].
  const std::vector<double>& start_state() const { return start_state_; }
  /// What is integrated in place of coordinates and joint rates; null: these.
  const IntegratedState* integrated_state() const { return state_.get(); }

  const Model& model() const { return *setup_->model; }
  const Setup& setup() const { return *setup_; }
  const std::shared_ptr<Setup>& shared_setup() const { return setup_; }

 private:
  size_t nq() const { return setup_->model->nq(); }
  size_t nv() const { return setup_->model->nv(); }
  size_t load_width() const { return 6 * static_cast<size_t>(setup_->model->n_loads()); }
  double* rates_in(double* y) const { return y + members_ * nq(); }
  const double* rates_in(const double* y) const { return y + members_ * nq(); }

  // The integrator's y holds rates in parent axes (parent_axes.hpp); every other y those of a
  // state.
  int size() const override { return static_cast<int>(members_ * (nq() + nv())); }
  int position_size() const override { return static_cast<int>(members_ * nq()); }
  Outcome evaluate(double t, const double* y, double* ydot) override;
  Outcome evaluate_aside(double t, const double* y, double* ydot) override;
  void position_rates(const double* q, const double* v, double* qdot) override;
  bool constrained() const override { return loops_ || model().nq() != model().nv(); }
  Outcome project(double t, double* y) override;
  void accepted(double t, const double* y) override;
  void error_scale(const double* y, double* scale) const override;
  bool solves_stiff_part() const override { return stiff_part_ != nullptr; }
  Outcome factor_stiff_part(double t, const double* y, double gamma) override;
  void solve_stiff_part(const double* r, double* z) override;
  void limit_errors(const double* y, double* allowed) const override {
    watch_->limit_errors(y, allowed);
  }
  double step_limit(double t) override {
    return std::min(step_limits_->after(t), watch_->step_limit(t));
  }
  bool has_jumped() const override { return watch_->has_jumped(); }
  bool retakes(double begin, double end, const double* y,
               const std::function<void(double, double*)>& state) override {
    return watch_->retakes(begin, end, y, state);
  }
  bool breaks_at(double t) override { return step_limits_->breaks_at(t); }

  void make_methods(double t0);
  void watch_forces();
  void evaluate_accepted(double t, double* y, double* ydot);
  void close_loops(double t0, const Start& start);
  void check_start(double t0, const double* asked, bool moving);
  void begin_coasting();
  bool follows_error_test() const;
  SweepInput<double> input(double t, const double* q, const double* v);
  void count_turns(double t, const double* y);
  BatchInput rows(const double* y, size_t member) const;
  Outcome evaluate_by(DynamicsMethod* method, double t, const double* y, double* ydot);
  Outcome accelerations(DynamicsMethod* method, double t, const double* y, double* du,
                        double* loads);
  Outcome on_lanes(double t, const double* y, double* du, double* loads);
  DynamicsReport observed(double t, const std::function<DynamicsReport()>& evaluation);
  void report_accepted() {
    if (observer_) observer_->accepted();
  }
  Outcome steer(double t, Outcome outcome, const Coasting::Aside& aside, double* dv, bool remember);
  std::vector<double> accelerate_beside(DynamicsMethod* method, double t, const double* q,
                                        const double* v, double fastest);
  LoopReport accelerate_closed(DynamicsMethod* method, double t, const double* q, const double* v,
                               bool closely, double* du);
  Coasting::Aside demanded_aside(DynamicsMethod* method, double t, const double* q,
                                 const double* v);
  void coast_on(double t, const double* y);
  Outcome steer_sample(double t, Outcome outcome);
  void evaluate_for(Extremes& extremes);
  bool evaluate_at(double t, const double* q, const double* v, double* du, double* loads,
                   double* drive);
  Outcome judge(double t, const DynamicsReport& report, const double* du, int n);
  std::string described(Outcome outcome, int body = -1) const;
  std::string of_singular_position() const;
  Ending failure(size_t member, double t, Outcome outcome, int body, const double* du) const;

  void to_state(double* y) const;
  void calc_position_rates(const double* q, const double* v, double* qdot) const;
  void impose(double t, double* y);
  void stand_in(double* y) const;
  bool any_running() const;
  bool any_ended() const;
  bool reach(double t);
  bool end_all(const Ending& ending);
  void interpolate(double t);
  void add_work_of_step();
  void keep_extremes_from(double t0, const double* tau);
  void add_step_to_extremes();
  bool powers(double t, double* out);
  bool write_sample(double t, const Sample& sample);
  void check_sample(double t, size_t member, const Sample& sample);
  Outcome evaluate_sample(double t, bool with_loads);
  void add_holding_torques(const double* loads, std::span<const double> couplings);
  void calc_torques_of_loads(const double* loads);
  void take_coupling_torques(std::span<const double> couplings);

  std::shared_ptr<Setup> setup_;
  ParentAxes parent_axes_;
  size_t members_ = 1;
  std::optional<AppliedForces> forces_;
  std::optional<StepLimits> step_limits_;
  std::optional<ForceWatch> watch_;
  /// Of one member; loads at output times are computed apart, to the fixed tolerance.
  std::unique_ptr<DynamicsMethod> method_, output_method_;
  std::unique_ptr<DynamicsMethod> aside_method_, work_method_;  ///< made when first needed
  std::unique_ptr<SolverTolerance> solver_tolerance_;  ///< of one member; null: a fixed one
  std::unique_ptr<StiffPart> stiff_part_;              ///< null: there is none to solve apart
  std::unique_ptr<LoopProjection> loops_;              ///< null: there are none
  std::string assembled_;
  std::vector<double> start_state_;
  Coasting coasting_;
  LoopReport loop_report_;  ///< of the last evaluation
  std::vector<double> steered_;
  std::vector<double> projected_;
  std::vector<double> work_loads_;
  std::unique_ptr<BatchEvaluator> lanes_;    ///< of several
  std::unique_ptr<BatchEvaluator> inverse_;  ///< made when first needed
  std::unique_ptr<Integrator> integrator_;
  std::unique_ptr<IntegratedState> state_;
  std::optional<WorkIntegral> work_;
  bool work_is_done_ = false;
  std::vector<double> directions_;
  std::optional<KeptExtremes> extremes_;  ///< none: not kept
  double advanced_to_ = 0;
  bool sampled_ = false;  ///< since the start
  /// Rows per member: state, that of an evaluation, given accelerations, samples.
  std::vector<double> y_, evaluated_, given_, du_, loads_, total_;
  std::vector<double> start_;  ///< positions there
  std::vector<Ending> endings_;
  Ending failure_;  ///< of the last evaluation of one member that failed in the present step
  long iterations_ = 0;
  double solver_error_ = 0.0;
  EvaluationObserver* observer_ = nullptr;
  std::function<bool()> interrupted_;
};

}  // namespace linkwise
