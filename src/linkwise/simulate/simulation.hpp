#pragma once
// The time loop: drives, dynamics and integrator, sampled at the times asked for. Free of Python
// apart from user callables.
#include <functional>
#include <memory>
#include <string>

#include "linkwise/dynamics/body_velocities.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/forces/drive.hpp"
#include "linkwise/integrate/integrator.hpp"
#include "linkwise/simulate/solver_tolerance.hpp"

namespace linkwise {

/// What is integrated beside the joint coordinates.
enum class StateChoice {
  joint_rates,
  body_velocities,  ///< the paper's: absolute velocities of the bodies [sharf1993]
};

/// InputError, listing the known names, when the name is unknown.
StateChoice state_choice_from_name(std::string_view name);

/// What a run's tolerance leaves to one step: the errors of hundreds of steps add up. Measured on
/// random trees (theory of integration): it keeps the energy of nearly all of them within ten
/// tolerances over 10 s, for a third more evaluations.
constexpr double step_share = 0.1;

struct SimulationOptions {
  DynamicsOptions dynamics;
  StateChoice state = StateChoice::joint_rates;
  /// The energy-norm rule of an iterative solver follows the integrator's error test, where it has
  /// one: see SolverTolerance. Otherwise its tolerance is that of the solver options.
  bool follow_error_test = false;
  IntegratorKind integrator = IntegratorKind::adams;
  IntegratorOptions integration;
};

/// Where one sample goes; null pointers are not computed.
struct Sample {
  double *position = nullptr, *velocity = nullptr, *acceleration = nullptr, *joint_load = nullptr,
         *drive_torque = nullptr;
  double* external = nullptr;  ///< wrenches on the bodies, [n_joints][6], in their own frames
  double *kinetic_energy = nullptr, *potential_energy = nullptr;
};

struct SimulationStatistics : IntegratorStatistics {
  long iterations = 0;
};

/// One evaluation of the equations of motion, where a trace is kept.
struct EvaluationTrace {
  double time = 0;     ///< simulated
  double seconds = 0;  ///< spent on accelerations and joint loads, drives left out
  int iterations = 0;
  bool accepted = false;  ///< the last evaluation of an accepted step
};

class Simulation : private OdeSystem {
 public:
  Simulation(std::shared_ptr<const Model> model, SimulationOptions options);

  const Model& model() const { return *model_; }
  void set_drive(int joint, Drive drive);
  void add_wrench(Wrench wrench);

  /// Fixes the drives and starts at t0. Rates of locked joints must be zero; the state of joints
  /// with a motion drive is that of the motion, whatever q0 and v0 say.
  void start(double t0, const double* q0, const double* v0);

  /// Steps until t is covered, then writes the sample there. False when the run stopped: see
  /// ending().
  bool advance(double t, const Sample& sample);

  const Ending& ending() const { return ending_; }
  SimulationStatistics statistics() const;

  /// Asked at every step: once it is true, the run stops with the outcome `interrupted`.
  void set_interrupt(std::function<bool()> interrupted) { interrupted_ = std::move(interrupted); }

  /// From the next start on, records every evaluation that the integrator asks for.
  void keep_trace(bool wanted) { keeps_trace_ = wanted; }
  const std::vector<EvaluationTrace>& trace() const { return trace_; }
  /// State body_velocities: how far joints come apart, in m/s or rad/s, at the last sample; else 0.
  double velocity_drift() const { return drift_; }

  const Choice& choice() const { return choice_; }
  const SimulationOptions& options() const { return options_; }
  const std::vector<Drive>& drives() const { return drives_; }
  const std::vector<Wrench>& wrenches() const { return wrenches_; }

 private:
  int size() const override {
    return model_->nq() + (body_velocities_ ? body_velocities_->size() : model_->nv());
  }
  int position_size() const override { return model_->nq(); }
  Outcome evaluate(double t, const double* y, double* ydot) override;
  void position_rates(const double* q, const double* v, double* qdot) override;
  void normalise(double* y) override;
  void accepted(double t, const double* y) override;

  SweepInput<double> applied_forces(double t, const double* q, const double* v);
  Outcome accelerations(DynamicsMethod& method, double t, const double* q, const double* v,
                        double* du, double* loads);
  template <class Evaluation>
  DynamicsReport traced(double t, Evaluation&& evaluation);
  bool follows_error_test() const;
  Outcome judge(double t, const DynamicsReport& report, const double* du, int n);
  void record_failure(double t, const DynamicsReport& report, const double* du);
  bool write_sample(double t, const Sample& sample);
  void impose_motion(double t, double* y);
  Outcome evaluate_imposed(double t, const double* y, double* ydot);
  void write_holding_torques(const double* q, const double* v, double* drive_torque);

  std::shared_ptr<const Model> model_;   ///< as the user sees it
  std::unique_ptr<const Model> driven_;  ///< the same with given motions prescribed, or null
  SimulationOptions options_;
  Choice choice_;
  std::vector<Drive> drives_;
  std::vector<Wrench> wrenches_;
  bool world_wrenches_ = false, any_motion_ = false;
  /// Joint loads at output times are computed apart, to the fixed tolerance.
  std::unique_ptr<DynamicsMethod> method_, output_method_;
  std::unique_ptr<InverseDynamics<double>> inverse_;
  std::unique_ptr<Integrator> integrator_;
  std::unique_ptr<BodyVelocities> body_velocities_;
  std::unique_ptr<SolverTolerance> solver_tolerance_;  ///< null: a fixed one
  std::vector<double> tau_, external_, poses_, y_, du_, holding_, rates_, imposed_, prescribed_;
  double drift_ = 0;
  long iterations_ = 0;
  bool keeps_trace_ = false;
  std::vector<EvaluationTrace> trace_;
  std::function<bool()> interrupted_;
  Ending ending_, failure_;
};

}  // namespace linkwise
