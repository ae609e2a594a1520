// How well forces of large gain are known: an error test sees to it where steps are chosen, and
// fixed steps are looked at.
#include "linkwise/simulate/simulation.hpp"

namespace linkwise {

/// By tests that see the joints' own rates.
void Simulation::watch_forces() {
  accuracy_.reset();
  fixed_forces_.clear();
  const SimulationOptions& options = setup_->options;
  if (options.state) return;
  if (find_integrator(options.integrator).fixed_step) {
    for (size_t i = 0; i < members_; ++i) fixed_forces_.emplace_back(*setup_);
    if (!fixed_forces_[0].any()) fixed_forces_.clear();
    return;
  }
  if (members_ > 1) return;
  accuracy_.emplace(*setup_);
  if (!accuracy_->any()) accuracy_.reset();
}

void Simulation::watch_start(double t, const double* y) {
  for (size_t i = 0; i < fixed_forces_.size(); ++i)
    fixed_forces_[i].start(t, y + i * nq(), rates_in(y) + i * nv());
}

void Simulation::watch_evaluation(double t, const double* ydot) {
  if (accuracy_) keep_acting(ydot);
  for (size_t i = 0; i < fixed_forces_.size(); ++i)
    if (endings_[i].ok()) fixed_forces_[i].evaluated(t, rates_in(ydot) + i * nv(), forces_->tau(i));
}

void Simulation::watch_step(double t, const double* y) {
  if (accuracy_) weigh_forces(t, y);
  for (size_t i = 0; i < fixed_forces_.size(); ++i)
    if (endings_[i].ok())
      fixed_forces_[i].accepted(t, y + i * nq(), rates_in(y) + i * nv(), breaks_at(t));
}

std::string Simulation::force_doubt(size_t member) const {
  std::string found;
  if (accuracy_) found = accuracy_->doubt();
  if (!fixed_forces_.empty()) found = FixedStepForces::text(model(), fixed_forces_[member].worst());
  if (!found.empty() || !loops_have_gains(*setup_)) return found;
  return "no error test watches those of springs, stops, dampers, friction and PD drives in what "
         "closes loops, which err by their gain times the error of the motion; a run at a tighter "
         "tolerance, or with shorter steps, shows by how much";
}

double Simulation::force_error(size_t member) const {
  if (fixed_forces_.empty()) return 0;
  const ForceDoubt found = fixed_forces_[member].worst();
  return found.row ? found.error / found.largest : 0;
}

void Simulation::keep_acting(const double* ydot) {
  acting_.assign(rates_in(ydot), rates_in(ydot) + nv());
  acting_.insert(acting_.end(), forces_->tau(0), forces_->tau(0) + nv());
}

void Simulation::weigh_forces(double t, const double* y) {
  scale_.resize(size());
  error_scale(y, scale_.data());
  const double* dv = acting_.data();
  accuracy_->accepted(t, {y, rates_in(y), dv, dv + nv(), scale_.data()});
}

void Simulation::limit_errors(const double* y, double* allowed) const {
  if (accuracy_) accuracy_->limit_errors(y, rates_in(y), allowed);
}

bool Simulation::retakes(double begin, double end, const double* y,
                         const std::function<void(double, double*)>& state) {
  if (!accuracy_) return false;
  return accuracy_->passes_stop(begin, end, y, rates_in(y), state);
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
