// What a simulation does for joints that close loops, and for those of given motion.
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/loop_work.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/simulate/given_motion.hpp"
#include "linkwise/simulate/simulation.hpp"

namespace linkwise {

void Simulation::close_loops(double t0, const Start& start) {
  loops_.reset();
  assembled_.clear();
  const Model& m = setup_->driven();
  if (m.n_loops() + m.n_couplings() == 0 && start.loop_rates.empty()) return;
  loops_ = std::make_unique<LoopProjection>(
      m, setup_->choice.method == "constraint_force" && count_loop_work(m).prefers_graph());
  normalise_quaternions(m, y_.data());
  LoopMotion given;
  if (LoopForces* forces = forces_->loops()) {
    forces->hold(y_.data());
    forces->give(t0);
    given = {forces->near_q(), forces->given_v()};
  }
  loops_->give(given);
  const std::vector<double> q(y_.begin(), y_.begin() + position_size()),
      v(y_.begin() + position_size(), y_.end());
  if (setup_->options.exact_start) {
    if (!start.loop_rates.empty())
      throw InputError(
          "loop_velocity: assemble='exact' takes all rates from v0; leave one of both out");
    require_assembled(m, q, v, given);
    return begin_coasting();
  }
  const Assembly found = assemble(m, q, v, start.hold, given, start.loop_rates);
  std::copy(found.q.begin(), found.q.end(), y_.begin());
  std::copy(found.v.begin(), found.v.end(), rates_in(y_.data()));
  begin_coasting();
  const auto list = [&](const char* text, const std::vector<std::string>& names) {
    for (size_t k = 0; k < names.size(); ++k)
      assembled_ += (k > 0                ? ", "
                     : assembled_.empty() ? text
                                          : std::string("; ") + text) +
                    names[k];
  };
  list("to close loops, joints were moved: ", found.moved);
  list("joints that were to be held had to move: ", found.released);
}

void Simulation::begin_coasting() {
  const double* const v = rates_in(y_.data());
  loops_->find_rank(y_.data(), v);
  const bool rests = std::all_of(v, v + nv(), [](double rate) { return rate == 0; });
  if (rests && loops_->lost_at_start() > 0)
    throw InputError("simulation of '" + model().spec().name + "'" +
                     " starts at rest in a singular position, where its loops hold fewer "
                     "directions than beside it: it may move on in several ways; start it beside "
                     "that position, or with rates");
  const IntegratorOptions& o = setup_->options.integration;
  coasting_.start(loops_->full_rank(),
                  o.relative_tolerance > 0 ? o.relative_tolerance : o.tolerance);
}

/// The state of joints of given motion is not integrated, and stays.
Outcome Simulation::project(double t, double* y) {
  for (size_t i = 0; i < members_; ++i) normalise_quaternions(model(), y + i * nq());
  if (!loops_) return Outcome::converged;
  projected_.assign(y, y + size());
  double *q = projected_.data(), *v = rates_in(q);
  to_state(q);
  impose(t, q);
  if (LoopForces* forces = forces_->loops()) forces->give(t);
  const Outcome outcome = loops_->project(q, v, coasting_.follows());
  if (outcome != Outcome::converged) {
    failure_ = {outcome, t, "", described(outcome)};
    return outcome;
  }
  parent_axes_.from_child(q, v);
  for (int j = 0; j < model().n_joints(); ++j) {
    if (setup_->drives[j].kind == DriveKind::motion) continue;
    const JointInfo& joint = model().joints[j];
    std::copy_n(q + joint.q, joint.nq, y + joint.q);
    std::copy_n(v + joint.v, joint.nv, rates_in(y) + joint.v);
  }
  return Outcome::converged;
}

/// dv: derivative of the rates of the integrator's y.
Outcome Simulation::steer(double t, Outcome outcome, const Coasting::Aside& aside, double* dv,
                          bool remember) {
  steered_.assign(dv, dv + nv());
  outcome = coasting_.steer(t, loop_report_, outcome, aside, steered_, remember);
  std::copy(steered_.begin(), steered_.end(), dv);
  return outcome;
}

/// What the constraints demand beside a state, or in it, once its loops are closed there. `strong`
/// is 0 where they cannot be. The report of the last evaluation stays what it is.
LoopReport Simulation::accelerate_closed(DynamicsMethod* method, double t, const double* q,
                                         const double* v, bool closely, double* du) {
  const LoopReport own = loop_report_;
  std::vector<double> at(q, q + nq()), rates(v, v + nv());
  LoopReport found;
  if (loops_->project(at.data(), rates.data(), closely) == Outcome::converged) {
    const DynamicsReport report =
        method->evaluate(t, input(t, at.data(), rates.data()), du, nullptr);
    if (report.ok()) found = report.loops;
  }
  input(t, q, v);  // what acts is that of the state itself
  loop_report_ = own;
  return found;
}

/// The accelerations in a singular position, or near one, of those beside it: along the path on
/// which the machine goes they are smooth. They are taken at eight positions before and behind, and
/// those of the polynomial of degree 7 through them. Empty where these are not known either, and
/// where steps are so short that those before serve as well: rounding errors come out less of them.
std::vector<double> Simulation::accelerate_beside(DynamicsMethod* method, double t, const double* q,
                                                  const double* v, double fastest) {
  constexpr double apart = 0.012, near = 0.15;  // rad, or m
  constexpr double weights[] = {0.8, -0.4, 4.0 / 35, -1.0 / 70};
  if (!(fastest > 0) || setup_->any_given()) return {};
  if (fastest * coasting_.reaches_back(t) < near) return {};
  std::vector<double> sum(nv()), way(nv()), beside, du(nv());
  for (int k = 0; k < 8; ++k) {
    const int steps = k / 2 + 1;
    for (size_t i = 0; i < nv(); ++i)
      way[i] = (k % 2 == 0 ? apart : -apart) * steps * v[i] / fastest;
    beside.assign(q, q + nq());
    move_by(model(), way.data(), beside.data());
    const LoopReport report = accelerate_closed(method, t, beside.data(), v, false, du.data());
    if (coasting_.is_near(report)) return {};
    for (size_t i = 0; i < nv(); ++i) sum[i] += weights[steps - 1] * du[i];
  }
  return sum;
}

/// In the integrator's axes; nothing where the machine is far from a singular position.
Coasting::Aside Simulation::demanded_aside(DynamicsMethod* method, double t, const double* q,
                                           const double* v) {
  Coasting::Aside aside;
  if (!coasting_.is_near(loop_report_) || coasting_.follows()) return aside;
  aside.fastest = 0;
  for (size_t i = 0; i < nv(); ++i) aside.fastest = std::max(aside.fastest, std::abs(v[i]));
  aside.beside = accelerate_beside(method, t, q, v, aside.fastest);
  aside.demand.resize(nv());
  aside.loops = accelerate_closed(method, t, q, v, true, aside.demand.data());
  for (auto* du : {&aside.beside, &aside.demand})
    if (!du->empty()) parent_axes_.derivative_from_child(q, v, du->data());
  return aside;
}

/// At an accepted state near a singular position: compares what the constraints demand there with
/// the polynomial.
void Simulation::coast_on(double t, const double* y) {
  coasting_.accepted();
  if (!coasting_.is_inside() || coasting_.follows()) return;
  projected_.assign(y, y + size());
  double *q = projected_.data(), *v = rates_in(q);
  to_state(q);
  impose(t, q);
  if (!aside_method_) aside_method_ = make_dynamics(setup_->driven(), setup_->options.dynamics);
  coasting_.compare(t, demanded_aside(aside_method_.get(), t, q, v));
}

/// steer() for the sample in du_ and y_, which hold a state's rates.
Outcome Simulation::steer_sample(double t, Outcome outcome) {
  if (outcome == Outcome::converged && loop_report_.strong >= loops_->full_rank()) return outcome;
  const double *q = y_.data(), *v = rates_in(q);
  const Coasting::Aside aside = demanded_aside(output_method_.get(), t, q, v);
  parent_axes_.derivative_from_child(q, v, du_.data());
  outcome = steer(t, outcome, aside, du_.data(), false);
  parent_axes_.derivative_to_child(q, v, du_.data());
  return outcome;
}

/// What the loops cannot follow, and why.
std::string Simulation::of_singular_position() const {
  const Outcome outcome = Outcome::singular_position;
  std::ostringstream text;
  const std::string motions = contradicting_motions(setup_->driven(), loops_->states());
  if (!motions.empty()) {
    text << motions
         << " from here on, or the machine is in a singular position that they do not lead out of; "
            "give motions that its loops can follow, or drive fewer of these joints";
    return text.str();
  }
  text << message(outcome);
  if (loops_->n_faint() > 0)
    text << ": " << loops_->n_faint() << " directions that its loops hold are held by only "
         << std::setprecision(1) << std::sqrt(loops_->faintest())
         << " of the others, as by axes that are parallel or points that meet but for the digits "
            "of the file; write them to all digits, or let a joint of each such loop turn or slide "
            "freely. Otherwise "
         << remedy(outcome);
  else
    text << "; " << remedy(outcome);
  return text.str();
}

std::string Simulation::loop_doubt() const {
  if (!loops_ || std::isnan(coasting_.passed())) return {};
  std::ostringstream text;
  text << "no bound of the loads holds: near t = " << std::setprecision(4) << coasting_.passed()
       << " s the machine passes a singular position, or one that is nearly so, where loads of its "
          "loops may grow without limit, and peaks are those of the states that were looked at. "
          "The motion there goes on from before, and where it stays near such positions it is not "
          "known to the tolerance: see that the energy balances";
  return text.str();
}

/// Loads between samples are those that a sample there would have.
void Simulation::evaluate_for(Extremes& extremes) {
  extremes.evaluate_by(
      {[this](double t, double* q, double* v) {
         impose_motion(model(), setup_->drives, t, q, v, given_.data());
         if (LoopForces* loops = forces_->loops()) loops->give(t);
         loops_->project(q, v);
       },
       [this](double t, const double* q, const double* v, double* du, double* loads,
              double* drive) { return evaluate_at(t, q, v, du, loads, drive); },
       [this](int l) {
         const LoopForces& loops = *forces_->loops();
         const JointInfo& joint = model().loops.joints[l].joint;
         double power = 0;
         for (int i = joint.v; i < joint.v + joint.nv; ++i)
           power += loops.drive()[i] * loops.v()[i];
         return power;
       }});
}

/// What fails there ends nothing.
bool Simulation::evaluate_at(double t, const double* q, const double* v, double* du, double* loads,
                             double* drive) {
  y_.assign(q, q + nq());
  y_.insert(y_.end(), v, v + nv());
  impose(t, y_.data());
  const Ending failure = failure_;
  const bool known = evaluate_sample(t, true) == Outcome::converged;
  failure_ = failure;
  if (!known) return false;
  std::copy(du_.begin(), du_.end(), du);
  std::copy(loads_.begin(), loads_.end(), loads);
  std::copy_n(forces_->drive(0), nv(), drive);
  return true;
}

/// The drive torques of joints of given motion: what the motion takes, less what acts by itself.
/// loads: joint loads of a machine with loops.
void Simulation::add_holding_torques(const double* loads, std::span<const double> couplings) {
  if (loops_) {
    calc_torques_of_loads(loads);
    take_coupling_torques(couplings);
    if (LoopForces* loops = forces_->loops()) loops->add_holding_torques(loads);
    return forces_->add_holding_torques(total_.data());
  }
  if (!inverse_) inverse_ = std::make_unique<BatchEvaluator>(model());
  total_.resize(members_ * nv());
  BatchInput in = rows(y_.data(), 0);
  in.du = du_.data();
  inverse_->inverse_dynamics(members_, in, total_.data(), nullptr);
  forces_->add_holding_torques(total_.data());
}

/// What joints of given motion pass on along their coordinates, and what their rotors take, into
/// total_.
void Simulation::calc_torques_of_loads(const double* loads) {
  const std::vector<double>& armature = model().dof_values(DofProperty::armature);
  total_.assign(nv(), 0.0);
  std::vector<double> rotors(nv());
  add_armature_bias(model(), rates_in(y_.data()), 1, rotors.data());
  for (int j = 0; j < model().n_joints(); ++j) {
    if (!is_prescribed(setup_->drives[j].kind)) continue;
    const JointInfo& joint = model().joints[j];
    torques_of_load(joint, model().elements, y_.data(), loads + 6 * j, total_.data());
    for (int k = joint.v; k < joint.v + joint.nv; ++k)
      total_[k] += armature[k] * du_[k] + rotors[k];
  }
}

/// What couplings put into joints of given motion is no torque of their drives.
void Simulation::take_coupling_torques(std::span<const double> couplings) {
  size_t k = 0;
  for (const Coupling& coupling : model().couplings)
    for (const Coupling::Term& term : coupling.terms) {
      const double torque = k < couplings.size() ? couplings[k] : 0;
      ++k;
      if (!is_prescribed(setup_->drives[term.joint].kind)) continue;
      if (term.closes)
        forces_->loops()->take_coupling_torque(term.v, torque);
      else
        total_[term.v] -= torque;
    }
}

/// At an accepted state: loop joints continue their turns from here.
void Simulation::count_turns(double t, const double* y) {
  projected_.assign(y, y + size());
  to_state(projected_.data());
  impose(t, projected_.data());
  forces_->loops()->accepted(t, projected_.data(), rates_in(projected_.data()));
}

}  // namespace linkwise
