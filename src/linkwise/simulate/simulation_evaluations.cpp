// How a simulation computes accelerations: its methods, what they are given, and what becomes of an
// evaluation that fails.
#include <cmath>
#include <limits>

#include "linkwise/dynamics/evaluator.hpp"
#include "linkwise/simulate/simulation.hpp"
#include "linkwise/simulate/stiff_part.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise {
namespace {

// Above this an acceleration counts as infinite. Below it no sum within a step can overflow, so a
// member that fails cannot end the others.
constexpr double largest_acceleration = 1e100;

}  // namespace

void Simulation::make_methods(double t0) {
  method_.reset();
  output_method_.reset();
  aside_method_.reset();
  work_method_.reset();
  solver_tolerance_.reset();
  stiff_part_.reset();
  lanes_.reset();
  if (members_ > 1) {
    lanes_ = std::make_unique<BatchEvaluator>(setup_->driven());
    return;
  }
  const SimulationOptions& options = setup_->options;
  DynamicsOptions integrated = options.dynamics;
  if (follows_error_test()) {
    const IntegratorOptions& o = options.integration;
    solver_tolerance_ = std::make_unique<SolverTolerance>(
        setup_->driven(), o.relative_tolerance > 0 ? o.relative_tolerance : o.tolerance,
        o.absolute_tolerance > 0 ? o.absolute_tolerance : o.tolerance,
        options.dynamics.solver_options.tolerance);
    integrated.solver_options.energy_bound = solver_tolerance_->bound();
    solver_tolerance_->start(t0);
  }
  if (StiffPart::suits(*setup_) && !find_integrator(options.integrator).fixed_step)
    stiff_part_ = std::make_unique<StiffPart>(*setup_);
  method_ = make_dynamics(setup_->driven(), integrated);
  output_method_ = make_dynamics(setup_->driven(), options.dynamics);
}

bool Simulation::follows_error_test() const {
  const SimulationOptions& options = setup_->options;
  const std::string& solver = setup_->choice.solver;
  if (!options.follow_error_test || options.state) return false;
  if (solver.empty() || find_solver(solver).kind == SolverKind::direct) return false;
  if (options.dynamics.solver_options.stop != StopRule::energy_norm) return false;
  // With the guess zero, solutions must depend on time and state alone.
  if (options.dynamics.initial_guess == "zero") return false;
  return !find_integrator(options.integrator).fixed_step;
}

/// Joints of given motion are where it puts them.
Outcome Simulation::factor_stiff_part(double t, const double* y, double gamma) {
  if (setup_->any_motion()) {
    evaluated_.assign(y, y + size());
    to_state(evaluated_.data());
    impose(t, evaluated_.data());
    parent_axes_.from_child(evaluated_.data(), rates_in(evaluated_.data()));
    y = evaluated_.data();
  }
  return stiff_part_->factor(y, gamma) ? Outcome::converged : Outcome::not_positive_definite;
}

void Simulation::solve_stiff_part(const double* r, double* z) { stiff_part_->solve(r, z); }

SweepInput<double> Simulation::input(double t, const double* q, const double* v) {
  forces_->evaluate(t, q, v);
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  in.tau = forces_->tau(0);
  in.prescribed = given_.data();
  in.external = forces_->external(0);
  if (const LoopForces* loops = forces_->loops()) {
    in.loop_tau = loops->tau();
    loops->give_to(in);
  }
  return in;
}

/// From `member` on.
BatchInput Simulation::rows(const double* y, size_t member) const {
  BatchInput in;
  in.q = y + member * nq();
  in.v = rates_in(y) + member * nv();
  in.tau = forces_->tau(member);
  in.prescribed = setup_->any_given() ? given_.data() + member * nv() : nullptr;
  in.external = forces_->external(member);
  return in;
}

/// method: of one member.
Outcome Simulation::accelerations(DynamicsMethod* method, double t, const double* y, double* du,
                                  double* loads) {
  if (lanes_) return on_lanes(t, y, du, loads);
  const SweepInput<double> in = input(t, y, rates_in(y));
  const auto evaluation = [&] { return method->evaluate(t, in, du, loads); };
  const bool is_integration = method == method_.get();
  return judge(t, is_integration ? observed(t, evaluation) : evaluation(), du,
               static_cast<int>(nv()));
}

/// Of all members; those whose evaluation fails end.
Outcome Simulation::on_lanes(double t, const double* y, double* du, double* loads) {
  forces_->evaluate(t, y, rates_in(y));
  const bool sound = lanes_->forward_dynamics(members_, rows(y, 0), du, loads) < 0;
  for (size_t i = 0; i < members_; ++i) {
    if (!endings_[i].ok()) continue;
    double* row = du + i * nv();
    const int body = sound ? -1
                           : lanes_->forward_dynamics(1, rows(y, i), row,
                                                      loads ? loads + i * load_width() : nullptr);
    bool finite = true;
    for (size_t k = 0; k < nv(); ++k) finite &= std::abs(row[k]) < largest_acceleration;
    if (body >= 0)
      endings_[i] = failure(i, t, Outcome::not_positive_definite, body, row);
    else if (!finite)
      endings_[i] = failure(i, t, Outcome::not_finite, -1, row);
  }
  return any_running() ? Outcome::converged : endings_[0].outcome;
}

DynamicsReport Simulation::observed(double t, const std::function<DynamicsReport()>& evaluation) {
  return observer_ ? observer_->evaluate(t, evaluation) : evaluation();
}

/// Of one member: an integrator that chooses its steps may recover, so nothing ends yet.
Outcome Simulation::judge(double t, const DynamicsReport& report, const double* du, int n) {
  iterations_ += report.iterations;
  loop_report_ = report.loops;
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += du[i];
  // If rounding keeps the forces from the accuracy that the error test asks for, the fixed
  // tolerance is good enough.
  const bool good_enough =
      solver_tolerance_ && report.outcome == Outcome::stagnated &&
      report.error_estimate <= setup_->options.dynamics.solver_options.tolerance;
  if ((report.ok() || good_enough) && std::isfinite(sum)) {
    if (report.iterations > 0)
      solver_error_ =
          std::max(solver_error_, report.error_is_bound ? report.error_estimate
                                                        : std::numeric_limits<double>::infinity());
    return Outcome::converged;
  }
  failure_ = failure(0, t, report.ok() ? Outcome::not_finite : report.outcome, report.body, du);
  return failure_.outcome;
}

Ending Simulation::failure(size_t member, double t, Outcome outcome, int body,
                           const double* du) const {
  const Model& m = model();
  // Looks at the torques first and then at the accelerations, because one bad torque spoils all
  // accelerations.
  int joint = body < 0 ? forces_->joint_with_bad_force(member) : -1;
  for (int j = 0; j < m.n_joints() && joint < 0; ++j) {
    const JointInfo& info = m.joints[j];
    if (body >= 0 && info.body == body && info.last_of_body) joint = j;
    for (int i = info.v; i < info.v + info.nv && body < 0; ++i)
      if (!(std::abs(du[i]) < largest_acceleration)) joint = j;
  }
  return {outcome, t, joint < 0 ? "" : m.joint_at(joint).name, described(outcome, body)};
}

/// A fixed step that is too long for a stiff machine ends in states that cannot be evaluated.
std::string Simulation::described(Outcome outcome, int body) const {
  if (outcome == Outcome::singular_position && loops_) return of_singular_position();
  const bool of_state = outcome == Outcome::not_finite || outcome == Outcome::not_positive_definite;
  if (!of_state || !find_integrator(setup_->options.integrator).fixed_step)
    return std::string(message(outcome)) + "; " + remedy_at(model(), outcome, body);
  return std::string(message(outcome)) +
         "; take a smaller step, or an integrator that chooses its steps. If that does not help, " +
         remedy_at(model(), outcome, body);
}

}  // namespace linkwise
