// How well forces of large gain are known: an error test sees to it where steps are chosen, and
// fixed steps are looked at.
#include <algorithm>

#include "linkwise/simulate/simulation.hpp"

namespace linkwise {

/// By tests that see the joints' own rates.
void Simulation::watch_forces() {
  accuracy_.reset();
  fixed_forces_.clear();
  loop_watch_.reset();
  const SimulationOptions& options = setup_->options;
  const std::vector<GainRow> rows = gain_rows(*setup_);
  if (options.state || rows.empty()) return;
  if (std::any_of(rows.begin(), rows.end(), [](const GainRow& row) { return row.closes; }))
    loop_watch_ =
        std::make_unique<LoopWatch>(*setup_, *forces_->loops(), [this](double t, double* y) {
          to_state(y);
          impose(t, y);
        });
  LoopWatch* const loops = loop_watch_.get();
  if (!find_integrator(options.integrator).fixed_step) {
    if (members_ == 1) accuracy_.emplace(*setup_, rows, loops);
    return;
  }
  for (size_t i = 0; i < members_; ++i) fixed_forces_.emplace_back(*setup_, rows, loops);
}

/// Of one member, with what closes loops where that is watched.
std::pair<const double*, const double*> Simulation::watched(double t, const double* y,
                                                            size_t member) {
  if (!loop_watch_) return {y + member * nq(), rates_in(y) + member * nv()};
  loop_watch_->update(t, y);
  return {loop_watch_->q(), loop_watch_->v()};
}

void Simulation::watch_start(double t, const double* y) {
  for (size_t i = 0; i < fixed_forces_.size(); ++i) {
    const auto [q, v] = watched(t, y, i);
    fixed_forces_[i].start(t, q, v);
  }
}

void Simulation::watch_evaluation(double t, const double* y, const double* ydot) {
  if (accuracy_) return keep_acting(ydot);
  if (loop_watch_) {
    if (fixed_forces_.empty() || !fixed_forces_[0].begins_step()) return;
    loop_watch_->accelerate(t, y, ydot, forces_->tau(0));
    return fixed_forces_[0].evaluated(t, loop_watch_->dv(), loop_watch_->tau());
  }
  for (size_t i = 0; i < fixed_forces_.size(); ++i)
    if (endings_[i].ok()) fixed_forces_[i].evaluated(t, rates_in(ydot) + i * nv(), forces_->tau(i));
}

void Simulation::watch_step(double t, const double* y) {
  if (accuracy_) weigh_forces(t, y);
  for (size_t i = 0; i < fixed_forces_.size(); ++i)
    if (endings_[i].ok()) {
      const auto [q, v] = watched(t, y, i);
      fixed_forces_[i].accepted(t, q, v, breaks_at(t));
    }
}

std::string Simulation::force_doubt(size_t member) const {
  if (accuracy_) return accuracy_->doubt();
  if (fixed_forces_.empty()) return {};
  return FixedStepForces::text(model(), fixed_forces_[member].worst());
}

double Simulation::force_error(size_t member) const {
  if (fixed_forces_.empty()) return 0;
  const ForceDoubt found = fixed_forces_[member].worst();
  return found.row ? found.error / found.largest : 0;
}

void Simulation::keep_acting(const double* ydot) {
  acting_.assign(ydot, ydot + size());
  acting_.insert(acting_.end(), forces_->tau(0), forces_->tau(0) + nv());
}

void Simulation::weigh_forces(double t, const double* y) {
  scale_.resize(size());
  error_scale(y, scale_.data());
  const double *ydot = acting_.data(), *tau = ydot + size();
  ForceAccuracy::State state{
      .q = y, .v = rates_in(y), .dv = rates_in(ydot), .tau = tau, .scale = scale_.data()};
  if (const LoopForces* loops = forces_->loops()) {
    projected_.assign(y, y + size());
    to_state(projected_.data());
    impose(t, projected_.data());
    state.closed_q = projected_.data();
    state.loop_q = loops->near_q();
  }
  if (loop_watch_) {
    loop_watch_->accelerate(t, y, ydot, tau, accuracy_->asks_accelerations());
    state.q = loop_watch_->q();
    state.v = loop_watch_->v();
    state.dv = loop_watch_->dv();
    state.tau = loop_watch_->tau();
  }
  accuracy_->accepted(t, state);
}

void Simulation::limit_errors(const double* y, double* allowed) const {
  if (accuracy_) accuracy_->limit_errors(y, rates_in(y), allowed);
}

bool Simulation::retakes(double begin, double end, const double* y,
                         const std::function<void(double, double*)>& state) {
  if (!accuracy_) return false;
  if (!loop_watch_) return accuracy_->passes_stop(begin, end, y, rates_in(y), state);
  std::vector<double> at(size());
  const auto with_loops = [&](double t, double* out) {
    state(t, at.data());
    const auto [q, v] = watched(t, at.data(), 0);
    out = std::copy_n(q, loop_watch_->nq(), out);
    std::copy_n(v, loop_watch_->nv(), out);
  };
  watched(end, y, 0);
  const std::vector<double> q(loop_watch_->q(), loop_watch_->q() + loop_watch_->nq()),
      v(loop_watch_->v(), loop_watch_->v() + loop_watch_->nv());
  return accuracy_->passes_stop(begin, end, q.data(), v.data(), with_loops);
}

double Simulation::step_limit(double t) {
  if (accuracy_ && !accuracy_->started()) {
    std::vector<double> y(size()), ydot(size());
    integrator_->interpolate(t, y);
    if (evaluate_aside(t, y.data(), ydot.data()) != Outcome::converged) ydot.assign(size(), 0.0);
    keep_acting(ydot.data());
    weigh_forces(t, y.data());
  }
  const double limit = step_limits_->after(t);
  return accuracy_ ? std::min(limit, accuracy_->step_limit(t)) : limit;
}

}  // namespace linkwise
