#include "linkwise/simulate/simulation.hpp"

#include <chrono>
#include <cmath>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "linkwise/forces/passive.hpp"
#include "linkwise/simulate/given_motion.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise {

StateChoice state_choice_from_name(std::string_view name) {
  if (name == "joint_rates") return StateChoice::joint_rates;
  if (name == "body_velocities") return StateChoice::body_velocities;
  throw InputError("state '" + std::string(name) + "' is unknown; known: joint_rates, " +
                   "body_velocities");
}

Simulation::Simulation(std::shared_ptr<const Model> model, SimulationOptions options)
    : model_(std::move(model)),
      options_(std::move(options)),
      choice_(choose_dynamics(*model_, options_.dynamics)),
      drives_(model_->n_joints()) {
  // Made once here so that bad options are refused before anything is written.
  if (options_.state == StateChoice::body_velocities) {
    if (options_.dynamics.method == "auto") options_.dynamics.method = "constraint_force";
    choice_ = choose_dynamics(*model_, options_.dynamics);
    BodyVelocities(*model_, options_.dynamics);
  }
  make_dynamics(*model_, options_.dynamics);
  make_integrator(options_.integrator, *this, options_.integration);
}

void Simulation::set_drive(int joint, Drive drive) {
  const JointInfo& info = model_->joints[joint];
  const bool is_motion = drive.kind == DriveKind::motion;
  if ((drive.kind == DriveKind::pd || is_motion) && info.nq != info.nv)
    throw InputError("joint '" + info.name + "'" + model_->where() + ": a " +
                     (is_motion ? "motion" : "pd") +
                     " drive needs angles or distances, not a quaternion; drive it by torque");
  drives_[joint] = std::move(drive);
}

void Simulation::add_wrench(Wrench wrench) {
  const JointInfo& info = model_->joints[wrench.joint];
  if (!info.last_of_body)
    throw InputError(
        "body '" + model_->links[info.link].name + "'" + model_->where() +
        " has no mass, so no wrench can act on it; apply it to the next body outboard");
  wrenches_.push_back(std::move(wrench));
}

void Simulation::start(double t0, const double* q0, const double* v0) {
  const Model& m = *model_;
  any_motion_ = false;
  for (const Drive& drive : drives_) any_motion_ |= drive.kind == DriveKind::motion;
  check_locked_joints(m, drives_, v0);
  if (any_motion_ && options_.state == StateChoice::body_velocities)
    throw InputError(
        "state body_velocities takes no motion drives; use the state joint_rates for them");
  driven_ = driven_model(m, drives_);
  const Model& driven = driven_ ? *driven_ : m;
  DynamicsOptions integrated = options_.dynamics;
  solver_tolerance_.reset();
  if (follows_error_test()) {
    const IntegratorOptions& o = options_.integration;
    solver_tolerance_ = std::make_unique<SolverTolerance>(
        driven, o.relative_tolerance > 0 ? o.relative_tolerance : o.tolerance,
        o.absolute_tolerance > 0 ? o.absolute_tolerance : o.tolerance,
        options_.dynamics.solver_options.tolerance);
    integrated.solver_options.energy_bound = solver_tolerance_->bound();
  }
  method_ = make_dynamics(driven, integrated);
  output_method_ = make_dynamics(driven, options_.dynamics);
  inverse_ = driven_ ? std::make_unique<InverseDynamics<double>>(m) : nullptr;
  world_wrenches_ = false;
  for (const Wrench& w : wrenches_) world_wrenches_ |= w.world;
  tau_.resize(m.nv());
  du_.resize(m.nv());
  holding_.resize(m.nv());
  prescribed_.assign(m.nv(), 0.0);
  imposed_.resize(any_motion_ ? size() : 0);
  external_.resize(wrenches_.empty() ? 0 : 6 * m.n_joints());
  poses_.resize(world_wrenches_ ? 16 * m.n_joints() : 0);
  y_.assign(q0, q0 + m.nq());
  body_velocities_.reset();
  drift_ = 0;
  if (options_.state == StateChoice::body_velocities) {
    body_velocities_ = std::make_unique<BodyVelocities>(driven, options_.dynamics);
    rates_.resize(m.nv());
    y_.resize(m.nq() + body_velocities_->size());
    body_velocities_->from_rates(q0, v0, y_.data() + m.nq());
  } else {
    y_.insert(y_.end(), v0, v0 + m.nv());
  }
  impose_motion(t0, y_.data());
  check_quaternions(m, y_.data());
  normalise(y_.data());
  iterations_ = 0;
  trace_.clear();
  ending_ = failure_ = Ending{};
  if (solver_tolerance_) solver_tolerance_->start(t0);
  integrator_ = make_integrator(options_.integrator, *this, options_.integration);
  integrator_->start(t0, y_);
}

bool Simulation::follows_error_test() const {
  if (!options_.follow_error_test || options_.state != StateChoice::joint_rates) return false;
  if (choice_.solver.empty() || find_solver(choice_.solver).kind == SolverKind::direct)
    return false;
  if (options_.dynamics.solver_options.stop != StopRule::energy_norm) return false;
  // Started from zero, solutions are to depend on time and state alone.
  if (options_.dynamics.initial_guess == "zero") return false;
  for (const IntegratorEntry& entry : integrator_registry())
    if (entry.kind == options_.integrator) return !entry.fixed_step;
  return false;
}

SweepInput<double> Simulation::applied_forces(double t, const double* q, const double* v) {
  const Model& m = *model_;
  std::fill(tau_.begin(), tau_.end(), 0.0);
  add_drive_torques(m, drives_, t, q, v, tau_.data());
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  in.tau = tau_.data();
  in.prescribed = prescribed_.data();
  if (!wrenches_.empty()) {
    if (world_wrenches_) body_poses(m, q, poses_.data());
    std::fill(external_.begin(), external_.end(), 0.0);
    add_wrenches(m, wrenches_, t, poses_.data(), external_.data());
    in.external = external_.data();
  }
  std::copy(tau_.begin(), tau_.end(), holding_.begin());  // the drives' share, for the record
  add_passive_forces(m, q, v, tau_.data());
  return in;
}

Outcome Simulation::accelerations(DynamicsMethod& method, double t, const double* q,
                                  const double* v, double* du, double* loads) {
  const SweepInput<double> in = applied_forces(t, q, v);
  const auto evaluation = [&] { return method.evaluate(t, in, du, loads); };
  const bool recorded = keeps_trace_ && &method == method_.get();
  return judge(t, recorded ? traced(t, evaluation) : evaluation(), du, model_->nv());
}

template <class Evaluation>
DynamicsReport Simulation::traced(double t, Evaluation&& evaluation) {
  const auto started = std::chrono::steady_clock::now();
  const DynamicsReport report = evaluation();
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - started;
  trace_.push_back({t, spent.count(), report.iterations, false});
  return report;
}

Outcome Simulation::judge(double t, const DynamicsReport& report, const double* du, int n) {
  iterations_ += report.iterations;
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += du[i];
  // Where rounding keeps the forces from what the error test would like, the fixed tolerance does.
  const bool good_enough = solver_tolerance_ && report.outcome == Outcome::stagnated &&
                           report.error_estimate <= options_.dynamics.solver_options.tolerance;
  if ((report.ok() || good_enough) && std::isfinite(sum)) return Outcome::converged;
  record_failure(t, report, du);
  return failure_.outcome;
}

void Simulation::record_failure(double t, const DynamicsReport& report, const double* du) {
  const Model& m = *model_;
  failure_.time = t;
  failure_.joint = -1;
  Outcome outcome = report.outcome;
  if (report.ok()) outcome = Outcome::not_finite;
  // What was given to a joint before what came out at it: one bad torque spoils all accelerations.
  const auto name_first = [&](const std::vector<double>& given, int first, int n, int j) {
    for (int i = first; i < first + n && !given.empty(); ++i)
      if (failure_.joint < 0 && !std::isfinite(given[i])) failure_.joint = j;
  };
  for (int j = 0; j < m.n_joints() && report.body < 0; ++j) {
    name_first(tau_, m.joints[j].v, m.joints[j].nv, j);
    name_first(external_, 6 * j, 6, j);
  }
  for (int j = 0; j < m.n_joints() && failure_.joint < 0; ++j) {
    const JointInfo& info = m.joints[j];
    if (report.body >= 0 && info.body == report.body && info.last_of_body) failure_.joint = j;
    for (int i = info.v; i < info.v + info.nv && report.body < 0; ++i)
      if (!std::isfinite(du[i])) failure_.joint = j;
  }
  failure_.outcome = outcome;
  failure_.text = describe(outcome);
}

Outcome Simulation::evaluate(double t, const double* y, double* ydot) {
  const Model& m = *model_;
  if (solver_tolerance_) solver_tolerance_->set(t);
  if (any_motion_) return evaluate_imposed(t, y, ydot);
  const double *q = y, *v = y + m.nq();
  position_rates(q, v, ydot);
  double* dv = ydot + m.nq();
  if (!body_velocities_) return accelerations(*method_, t, q, v, dv, nullptr);
  const SweepInput<double> in = applied_forces(t, q, rates_.data());
  const auto evaluation = [&] { return body_velocities_->evaluate(t, in, v, dv); };
  const DynamicsReport report = keeps_trace_ ? traced(t, evaluation) : evaluation();
  return judge(t, report, dv, body_velocities_->size());
}

Outcome Simulation::evaluate_imposed(double t, const double* y, double* ydot) {
  const Model& m = *model_;
  std::copy(y, y + size(), imposed_.begin());
  impose_motion(t, imposed_.data());
  const double *q = imposed_.data(), *v = q + m.nq();
  position_rates(q, v, ydot);
  const Outcome outcome = accelerations(*method_, t, q, v, ydot + m.nq(), nullptr);
  rest_imposed(m, drives_, ydot, ydot + m.nq());
  return outcome;
}

void Simulation::impose_motion(double t, double* y) {
  if (!any_motion_) return;
  linkwise::impose_motion(*model_, drives_, t, y, y + model_->nq(), prescribed_.data());
}

void Simulation::position_rates(const double* q, const double* v, double* qdot) {
  if (body_velocities_) {
    body_velocities_->to_rates(q, v, rates_.data());
    v = rates_.data();
  }
  for (const Element& e : model_->elements) element_position_rate(e, q, v, qdot);
}

void Simulation::normalise(double* y) { normalise_quaternions(*model_, y); }

void Simulation::accepted(double t, const double* y) {
  if (!trace_.empty()) trace_.back().accepted = true;
  if (solver_tolerance_) solver_tolerance_->accepted(t, y, y + model_->nq());
  if (body_velocities_)
    body_velocities_->accepted(t);
  else
    method_->accepted(t);
}

bool Simulation::advance(double t, const Sample& sample) {
  if (!ending_.ok()) return false;
  while (integrator_->time() < t) {
    Outcome outcome = Outcome::interrupted;
    if (!interrupted_ || !interrupted_()) outcome = integrator_->step(t);
    if (outcome == Outcome::converged) continue;
    // What failed within the step says more than that it failed.
    ending_ = failure_.outcome == outcome
                  ? failure_
                  : Ending{outcome, integrator_->time(), failure_.joint, describe(outcome)};
    return false;
  }
  integrator_->interpolate(t, y_);
  impose_motion(t, y_.data());
  return write_sample(t, sample);
}

bool Simulation::write_sample(double t, const Sample& s) {
  const Model& m = *model_;
  const double *q = y_.data(), *v = y_.data() + m.nq();
  if (body_velocities_) {
    drift_ = body_velocities_->drift(q, v);
    body_velocities_->to_rates(q, v, rates_.data());
    v = rates_.data();
  }
  if (s.position) std::copy(q, q + m.nq(), s.position);
  if (s.velocity) std::copy(v, v + m.nv(), s.velocity);
  if (s.acceleration || s.joint_load || s.drive_torque || s.external) {
    const long iterations = iterations_;
    const Outcome outcome = accelerations(*output_method_, t, q, v, du_.data(), s.joint_load);
    iterations_ = iterations;  // those of the record are not the integration's
    if (outcome != Outcome::converged) {
      ending_ = failure_;
      return false;
    }
    output_method_->accepted(t);
    if (s.acceleration) std::copy(du_.begin(), du_.end(), s.acceleration);
    if (s.external) {
      if (external_.empty())
        std::fill_n(s.external, 6 * m.n_joints(), 0.0);
      else
        std::copy(external_.begin(), external_.end(), s.external);
    }
    if (s.drive_torque) {
      std::copy(holding_.begin(), holding_.end(), s.drive_torque);
      write_holding_torques(q, v, s.drive_torque);
    }
  }
  if (s.kinetic_energy) *s.kinetic_energy = kinetic_energy(m, q, v);
  if (s.potential_energy) *s.potential_energy = potential_energy(m, q);
  return true;
}

/// What moves or holds a joint of given motion: the torque of the motion less what the joint does
/// by itself.
void Simulation::write_holding_torques(const double* q, const double* v, double* drive_torque) {
  if (!driven_) return;
  const Model& m = *model_;
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  in.external = wrenches_.empty() ? nullptr : external_.data();
  std::vector<double> total(m.nv());
  inverse_->evaluate(in, du_.data(), total.data(), nullptr);
  for (int j = 0; j < m.n_joints(); ++j) {
    if (!is_prescribed(drives_[j].kind)) continue;
    const JointInfo& info = m.joints[j];
    for (int i = info.v; i < info.v + info.nv; ++i)
      drive_torque[i] = total[i] - (tau_[i] - holding_[i]);
  }
}

SimulationStatistics Simulation::statistics() const {
  SimulationStatistics out;
  if (integrator_) static_cast<IntegratorStatistics&>(out) = integrator_->statistics();
  out.iterations = iterations_;
  return out;
}

}  // namespace linkwise
