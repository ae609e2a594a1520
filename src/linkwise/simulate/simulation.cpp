#include "linkwise/simulate/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/evaluator.hpp"
#include "linkwise/simulate/given_motion.hpp"
#include "linkwise/simulate/stiff_part.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise {
namespace {

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
  close_loops(t0, start);
  if (loops_) check_start(t0, rates_in(asked.data()), !start.loop_rates.empty());
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
  keep_extremes_from(t0, start.tau);
  if (state_) return integrator_->start(t0, state_->from_rates(y_));
  std::vector<double> y = y_;
  for (size_t i = 0; i < members_; ++i)
    parent_axes_.from_child(y.data() + i * nq(), rates_in(y.data()) + i * nv());
  integrator_->start(t0, y);
  integrator_->interpolate(t0, y);
  watch_->start(t0, y.data());
}

/// Tells what closing loops did to the rates that were asked for, `moving`: to those of joints that
/// are to move. Refuses a start at rest where forces of loops have no bound.
void Simulation::check_start(double t0, const double* asked, bool moving) {
  const double* got = rates_in(y_.data());
  if (const std::string changed = changed_rates(model(), asked, got, moving); !changed.empty())
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

void Simulation::watch_forces() {
  watch_.emplace(*setup_, *forces_, members_,
                 ForceWatch::Host{
                     [this](double t, double* y) {
                       to_state(y);
                       impose(t, y);
                     },
                     [this](const double* y, double* scale) { error_scale(y, scale); },
                     [this](double t, double* y, double* ydot) { evaluate_accepted(t, y, ydot); }});
}

/// At the state accepted last.
void Simulation::evaluate_accepted(double t, double* y, double* ydot) {
  integrator_->interpolate(t, {y, static_cast<size_t>(size())});
  if (evaluate_aside(t, y, ydot) != Outcome::converged) std::fill_n(ydot, size(), 0.0);
}

// ---- What the integrator sees -------------------------------------------------------------------

Outcome Simulation::evaluate(double t, const double* y, double* ydot) {
  if (solver_tolerance_) solver_tolerance_->set(t);
  const Outcome outcome = evaluate_by(method_.get(), t, y, ydot);
  if (outcome == Outcome::converged) watch_->evaluated(t, y, ydot, endings_);
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
  watch_->accepted(t, y, breaks_at(t), endings_);
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

void Simulation::keep_extremes_from(double t0, const double* tau) {
  extremes_.reset();
  advanced_to_ = t0;
  if (directions_.empty()) return;
  extremes_.emplace(
      *setup_, members_, tau, directions_, [this](double t) -> const auto& {
        interpolate(t);
        return y_;
      });
  for (Extremes& of_member : extremes_->of_members())
    if (loops_) evaluate_for(of_member);
  extremes_->begin(t0, y_);
}

void Simulation::add_step_to_extremes() {
  if (!extremes_) return;
  const double t = integrator_->time();
  extremes_->add_step(t, breaks_at(t), endings_);
}

std::vector<double> Simulation::extremes(size_t member) {
  return extremes_->found(member, advanced_to_, endings_[member].ok(),
                          loops_ && !std::isnan(coasting_.passed()));
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
