#include "linkwise/simulate/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/evaluator.hpp"
#include "linkwise/simulate/given_motion.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise {
namespace {

// Above this an acceleration counts as infinite. Below it no sum within a step can overflow, so a
// member that fails cannot end the others.
constexpr double largest_acceleration = 1e100;

constexpr double whole_turn = 2 * std::numbers::pi;

}  // namespace

Simulation::Simulation(std::shared_ptr<const Model> model, SimulationOptions options)
    : Simulation(std::make_shared<Setup>(std::move(model), std::move(options))) {}
Simulation::Simulation(std::shared_ptr<Setup> setup)
    : setup_(std::move(setup)), parent_axes_(*setup_->model), endings_(1) {}
Simulation::~Simulation() = default;

void Simulation::start(double t0, const Start& start) {
  const Model& m = model();
  members_ = start.members;
  if (members_ > 1) check_members(*setup_);
  setup_->settle();
  make_methods(t0);
  for (size_t i = 0; i < members_; ++i) check_locked_joints(m, setup_->drives, start.v + i * nv());
  forces_.emplace(*setup_, members_, start.tau);
  step_limits_.emplace(setup_->breakpoints(), t0);
  watch_forces();
  inverse_.reset();
  given_.assign(members_ * nv(), 0.0);
  y_.assign(start.q, start.q + members_ * nq());
  y_.insert(y_.end(), start.v, start.v + members_ * nv());
  impose(t0, y_.data());
  for (size_t i = 0; i < members_; ++i) check_quaternions(m, y_.data() + i * nq());
  const std::vector<double> asked = y_;
  close_loops(t0, start.hold);
  if (loops_) check_start(t0, rates_in(asked.data()));
  if (LoopForces* loops = forces_->loops()) {
    loops->accepted(t0, y_.data(), rates_in(y_.data()));
    loops->require_directions();
  }
  start_state_ = y_;
  endings_.assign(members_, {Outcome::converged, t0, "", ""});
  failure_ = {};
  iterations_ = 0;
  solver_error_ = 0.0;
  work_.reset();
  work_is_done_ = start.tau || setup_->does_work();
  sampled_ = false;
  if (observer_) observer_->started();
  state_.reset();
  OdeSystem* system = this;
  if (setup_->options.state) {
    state_ = setup_->options.state->make(
        setup_->driven(), setup_->options.dynamics,
        {[this](double t, const double* q, const double* u) { return input(t, q, u); },
         [this](double t, const auto& evaluation, const double* ydot, int n) {
           return judge(t, observed(t, evaluation), ydot, n);
         },
         [this] { report_accepted(); }, &*step_limits_});
    system = state_.get();
  }
  integrator_ = make_integrator(setup_->options.integrator, *system, setup_->options.integration);
  start_.assign(y_.begin(), y_.begin() + position_size());
  extremes_.clear();
  for (size_t i = 0; i < members_ && !directions_.empty(); ++i) {
    extremes_.emplace_back(*setup_, start.tau ? start.tau + i * nv() : nullptr, directions_);
    if (loops_) evaluate_for(extremes_[i]);
    extremes_[i].begin(t0, y_.data() + i * nq(), rates_in(y_.data()) + i * nv());
  }
  extremes_until_ = advanced_to_ = t0;
  if (state_) return integrator_->start(t0, state_->from_rates(y_));
  std::vector<double> y = y_;
  for (size_t i = 0; i < members_; ++i)
    parent_axes_.from_child(y.data() + i * nq(), rates_in(y.data()) + i * nv());
  integrator_->start(t0, y);
  integrator_->interpolate(t0, y);
  watch_start(t0, y.data());
}

/// Tells what closing loops did to the rates that were asked for. Refuses a start at rest where
/// forces of loops have no bound.
void Simulation::check_start(double t0, const double* asked) {
  const double* got = rates_in(y_.data());
  if (const std::string changed = changed_rates(model(), asked, got); !changed.empty())
    assembled_ += (assembled_.empty() ? "" : "; ") +
                  ("rates that keep loops closed are not those asked for: " + changed);
  const bool rests = std::all_of(got, got + nv(), [](double rate) { return rate == 0; });
  if (!rests || can_go_on(setup_->driven(), *loops_, y_.data())) return;
  du_.resize(nv());
  if (accelerations(output_method_.get(), t0, y_.data(), du_.data(), nullptr) != Outcome::converged)
    return;
  constexpr double noise = 1e-9;  // rad/s2, m/s2
  const bool pushed =
      std::any_of(du_.begin(), du_.end(), [](double x) { return std::abs(x) > noise; });
  if (pushed && !can_go_on(setup_->driven(), *loops_, y_.data(), du_.data()))
    throw InputError("simulation of '" + model().spec().name + "'" + model().where() +
                     " starts at rest in a singular position that it cannot leave, as that of a "
                     "triangle folded flat, and is pushed to: loads of its loops have no bound; "
                     "change lengths or places of joints, or let a stiff spring stand for a rod");
}

void Simulation::make_methods(double t0) {
  method_.reset();
  output_method_.reset();
  aside_method_.reset();
  work_method_.reset();
  solver_tolerance_.reset();
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

// ---- Accelerations ------------------------------------------------------------------------------

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

// ---- What the integrator sees -------------------------------------------------------------------

Outcome Simulation::evaluate(double t, const double* y, double* ydot) {
  if (solver_tolerance_) solver_tolerance_->set(t);
  const Outcome outcome = evaluate_by(method_.get(), t, y, ydot);
  if (outcome == Outcome::converged) watch_evaluation(t, y, ydot);
  return outcome;
}

/// Warm starts, the trace of evaluations and the reason of a failure stay what they are.
Outcome Simulation::evaluate_aside(double t, const double* y, double* ydot) {
  if (!aside_method_) aside_method_ = make_dynamics(setup_->driven(), setup_->options.dynamics);
  const Ending failure = failure_;
  const Outcome outcome = evaluate_by(aside_method_.get(), t, y, ydot);
  failure_ = failure;
  return outcome;
}

Outcome Simulation::evaluate_by(DynamicsMethod* method, double t, const double* y, double* ydot) {
  const bool given = setup_->any_motion(), ended = any_ended();
  double* dv = rates_in(ydot);
  if (given || ended || !parent_axes_.trivial()) {
    evaluated_.assign(y, y + size());
    if (ended) stand_in(evaluated_.data());
    to_state(evaluated_.data());
    impose(t, evaluated_.data());
    y = evaluated_.data();
  }
  calc_position_rates(y, rates_in(y), ydot);
  Outcome outcome = accelerations(method, t, y, dv, nullptr);
  const Coasting::Aside aside =
      loops_ ? demanded_aside(method, t, y, rates_in(y)) : Coasting::Aside{};
  for (size_t i = 0; i < members_; ++i)
    parent_axes_.derivative_from_child(y + i * nq(), rates_in(y) + i * nv(), dv + i * nv());
  if (loops_) outcome = steer(t, outcome, aside, dv, method == method_.get());
  for (size_t i = 0; i < members_ && (given || any_ended()); ++i) {
    if (members_ > 1 && !endings_[i].ok()) {
      std::fill_n(ydot + i * nq(), nq(), 0.0);
      std::fill_n(dv + i * nv(), nv(), 0.0);
    } else if (given) {
      rest_imposed(model(), setup_->drives, ydot + i * nq(), dv + i * nv());
    }
  }
  return outcome;
}

void Simulation::position_rates(const double* q, const double* v, double* qdot) {
  if (parent_axes_.trivial()) return calc_position_rates(q, v, qdot);
  evaluated_.assign(q, q + position_size());
  evaluated_.insert(evaluated_.end(), v, v + members_ * nv());
  to_state(evaluated_.data());
  calc_position_rates(q, rates_in(evaluated_.data()), qdot);
}

void Simulation::calc_position_rates(const double* q, const double* v, double* qdot) const {
  for (size_t i = 0; i < members_; ++i)
    for (const Element& e : model().elements)
      element_position_rate(e, q + i * nq(), v + i * nv(), qdot + i * nq());
}

void Simulation::accepted(double t, const double* y) {
  report_accepted();
  if (solver_tolerance_) {
    if (breaks_at(t)) solver_tolerance_->start(t);  // steps are tiny again
    solver_tolerance_->accepted(t, y, rates_in(y));
  }
  if (method_) method_->accepted(t);
  if (loops_) coast_on(t, y);
  if (forces_->loops()) count_turns(t, y);
  watch_step(t, y);
}

/// The same motion is held as well many turns later or far from the origin: angles are weighed by
/// what they are beyond whole turns, distances by the way from the start.
void Simulation::error_scale(const double* y, double* scale) const {
  for (int i = 0; i < size(); ++i) scale[i] = std::abs(y[i]);
  for (size_t i = 0; i < members_; ++i)
    for (const Element& e : model().elements)
      for (int k = 0; k < e.nq; ++k) {
        const size_t at = i * nq() + e.q + k;
        const std::string_view unit = unit_of_coordinate(e.kind, k);
        if (unit == "rad")
          scale[at] = std::abs(y[at] - whole_turn * std::nearbyint(y[at] / whole_turn));
        else if (unit == "m")
          scale[at] = std::abs(y[at] - start_[at]);
      }
}

/// Rates in parent axes become those of a state.
void Simulation::to_state(double* y) const {
  for (size_t i = 0; i < members_; ++i) parent_axes_.to_child(y + i * nq(), rates_in(y) + i * nv());
}

/// Writes what motion drives give at time t.
void Simulation::impose(double t, double* y) {
  if (!setup_->any_motion()) return;
  for (size_t i = 0; i < members_; ++i)
    impose_motion(model(), setup_->drives, t, y + i * nq(), rates_in(y) + i * nv(),
                  given_.data() + i * nv());
}

/// Rows of members that ended become copies of a member that did not, so that their lanes compute
/// something sound.
void Simulation::stand_in(double* y) const {
  size_t from = 0;
  while (from < members_ && !endings_[from].ok()) ++from;
  for (size_t i = 0; i < members_ && from < members_; ++i) {
    if (endings_[i].ok()) continue;
    std::copy_n(y + from * nq(), nq(), y + i * nq());
    std::copy_n(rates_in(y) + from * nv(), nv(), rates_in(y) + i * nv());
  }
}

// ---- The loop -----------------------------------------------------------------------------------

bool Simulation::any_running() const {
  for (const Ending& ending : endings_)
    if (ending.ok()) return true;
  return false;
}

bool Simulation::any_ended() const {
  for (const Ending& ending : endings_)
    if (!ending.ok()) return true;
  return false;
}

bool Simulation::end_all(const Ending& ending) {
  for (Ending& one : endings_)
    if (one.ok()) one = ending;
  return false;
}

bool Simulation::reach(double t) {
  while (integrator_->time() < t) {
    add_step_to_extremes();
    if (!any_running()) return false;
    Outcome outcome = Outcome::interrupted;
    if (!interrupted_ || !interrupted_()) outcome = integrator_->step(t);
    if (outcome == Outcome::converged) {
      failure_ = {};  // the step recovered from it
      if (work_ && work_is_done_) add_work_of_step();
      continue;
    }
    // The failure within the step says more than the failure of the step.
    if (failure_.outcome == outcome) return end_all(failure_);
    return end_all({outcome, integrator_->time(),
                    outcome == Outcome::interrupted ? "" : failure_.joint, described(outcome)});
  }
  if (integrator_->time() == t) add_step_to_extremes();
  return any_running();
}

bool Simulation::advance(double t, const Sample& sample) {
  const bool asks_work = sample.needs(Needs::works);
  if (!std::exchange(sampled_, true) && asks_work)
    work_.emplace(model(), members_, integrator_->time());
  if (!reach(t)) return false;
  advanced_to_ = t;
  if (work_ && work_is_done_ && asks_work) work_->reach(t);
  interpolate(t);
  return write_sample(t, sample);
}

/// Writes the state at t, within the last step, into y_.
void Simulation::interpolate(double t) {
  if (state_) {
    state_->interpolate(*integrator_, t, y_);
  } else {
    integrator_->interpolate(t, y_);
    to_state(y_.data());
  }
  impose(t, y_.data());
}

/// A method of order p resolves the motion up to the power p of time. Of given motions, which are
/// not integrated, it says nothing: there steps are halved until that changes nothing. Functions of
/// the caller's may cost more than all the rest: there the quadrature alone is as good.
void Simulation::add_work_of_step() {
  // Far below what integration to usual tolerances leaves, so that it does not show which members
  // share their steps.
  constexpr double fine = 1e-12;
  const bool fixed_step = find_integrator(setup_->options.integrator).fixed_step;
  const int order = statistics().last_order;
  int nodes = setup_->calls_functions() ? order / 2 + 2 : order + 2;
  double tolerance = 0;
  if (setup_->any_motion()) {
    tolerance = fine;
    if (!fixed_step) nodes = WorkIntegral::most_nodes;
  }
  work_->add_step(integrator_->time(), nodes, tolerance,
                  [this](double t, double* out) { return powers(t, out); });
}

/// The last step counts once it is reached as a whole.
void Simulation::add_step_to_extremes() {
  const double t = integrator_->time();
  if (extremes_.empty() || !(t > extremes_until_)) return;
  interpolate_step(t);
  for (size_t i = 0; i < members_; ++i)
    if (endings_[i].ok()) add_step(i, t, breaks_at(t), extremes_[i]);
  extremes_until_ = t;
}

/// From where extremes were kept until t.
void Simulation::interpolate_step(double t) {
  interpolate(extremes_until_ + (t - extremes_until_) / 2);
  middle_ = y_;
  interpolate(t);
}

void Simulation::add_step(size_t member, double t, bool breaks, Extremes& to) const {
  to.add_step(middle_.data() + member * nq(), rates_in(middle_.data()) + member * nv(), t,
              y_.data() + member * nq(), rates_in(y_.data()) + member * nv(), breaks);
}

std::vector<double> Simulation::extremes(size_t member) {
  extremes_[member].trim();
  Extremes whole = extremes_[member];
  if (advanced_to_ > extremes_until_ && endings_[member].ok()) {
    interpolate_step(advanced_to_);
    add_step(member, advanced_to_, false, whole);
  }
  if (loops_ && !std::isnan(coasting_.passed())) whole.leave_loads_open();
  return std::move(whole).found();
}

/// What holds joints of given motion follows from the accelerations of the others. False where
/// these were not found.
bool Simulation::powers(double t, double* out) {
  interpolate(t);
  const double* v = rates_in(y_.data());
  bool known = true;
  if (setup_->any_motion()) {
    if (any_ended()) stand_in(y_.data());
    if (!lanes_ && !work_method_)
      work_method_ = make_dynamics(setup_->driven(), setup_->options.dynamics);
    const long iterations = iterations_;
    const Ending failure = failure_;
    du_.resize(members_ * nv());
    work_loads_.resize(loops_ ? load_width() : 0);
    known = accelerations(work_method_.get(), t, y_.data(), du_.data(),
                          loops_ ? work_loads_.data() : nullptr) == Outcome::converged;
    iterations_ = iterations;
    failure_ = failure;
    if (work_method_) work_method_->accepted(t);
    add_holding_torques(work_loads_.data(),
                        work_method_ ? work_method_->coupling_load() : std::span<const double>());
  } else {
    forces_->evaluate(t, y_.data(), v);
  }
  const size_t width = WorkIntegral::width(model());
  for (size_t i = 0; i < members_; ++i)
    write_powers(model(), *forces_, i, y_.data() + i * nq(), v + i * nv(), out + i * width);
  return known;
}

/// Of the state in y_: accelerations, loads and drive torques, as they are recorded.
Outcome Simulation::evaluate_sample(double t, bool with_loads) {
  du_.resize(members_ * nv());
  with_loads |= loops_ && setup_->any_given();  // which give the torques that hold joints
  loads_.resize(with_loads ? members_ * load_width() : 0);
  if (any_ended()) stand_in(y_.data());
  const long iterations = iterations_;
  double* loads = with_loads ? loads_.data() : nullptr;
  Outcome outcome = accelerations(output_method_.get(), t, y_.data(), du_.data(), loads);
  if (loops_) outcome = steer_sample(t, outcome);
  iterations_ = iterations;  // those of the record are not the integration's
  if (outcome == Outcome::converged && output_method_) output_method_->accepted(t);
  if (outcome == Outcome::converged && setup_->any_given())
    add_holding_torques(loads_.data(), output_method_ ? output_method_->coupling_load()
                                                      : std::span<const double>());
  return outcome;
}

bool Simulation::write_sample(double t, const Sample& sample) {
  if (sample.needs(Needs::forces)) {
    const Outcome outcome = evaluate_sample(t, sample.needs(Needs::loads));
    if (outcome != Outcome::converged) {
      if (failure_.ok()) failure_ = {outcome, t, "", described(outcome)};  // coasting had to end
      return end_all(failure_);
    }
  } else if (LoopForces* loops = forces_->loops()) {
    loops->update(t, y_.data(), rates_in(y_.data()));
  }
  const std::span<const double> couplings =
      output_method_ ? output_method_->coupling_load() : std::span<const double>();
  const SimulationStatistics now = statistics();
  for (size_t i = 0; i < members_; ++i) {
    const Instant at{model(),
                     y_.data() + i * nq(),
                     rates_in(y_.data()) + i * nv(),
                     du_.data() + i * nv(),
                     loads_.data() + i * load_width(),
                     forces_->drive(i),
                     forces_->external(i),
                     work_ ? work_->of(i) : nullptr,
                     now,
                     forces_->loops(),
                     couplings.data()};
    const bool running = endings_[i].ok();
    sample.write(model(), i, running ? &at : nullptr);
    if (running) check_sample(t, i, sample);
  }
  return any_running();
}

/// Ends a member whose row holds what is no number: products of huge values overflow in loads and
/// energies before states do.
void Simulation::check_sample(double t, size_t member, const Sample& sample) {
  const std::string_view wrong = sample.not_finite(model(), member, work_ && work_->known());
  if (wrong.empty()) {
    endings_[member].time = t;
    return;
  }
  endings_[member] = {Outcome::not_finite, t, "",
                      std::string(wrong) +
                          " is not finite; check masses, inertias, drives and the state for values "
                          "that are far too large"};
  sample.write(model(), member, nullptr);
}

SimulationStatistics Simulation::statistics() const {
  SimulationStatistics out;
  if (integrator_) static_cast<IntegratorStatistics&>(out) = integrator_->statistics();
  out.iterations = iterations_;
  out.solver_error = solver_error_;
  return out;
}

}  // namespace linkwise
