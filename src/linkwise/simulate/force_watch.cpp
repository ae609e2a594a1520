#include "linkwise/simulate/force_watch.hpp"

#include <algorithm>

#include "linkwise/integrate/integrator.hpp"

namespace linkwise {

/// Tests see the joints' own rates.
ForceWatch::ForceWatch(const Setup& setup, AppliedForces& forces, size_t members, Host host)
    : setup_(setup),
      forces_(forces),
      members_(members),
      nq_(setup.model->nq()),
      nv_(setup.model->nv()),
      host_(std::move(host)) {
  const std::vector<GainRow> rows = gain_rows(setup);
  if (setup.options.state || rows.empty()) return;
  if (std::any_of(rows.begin(), rows.end(), [](const GainRow& row) { return row.closes; }))
    loops_ = std::make_unique<LoopWatch>(setup, *forces.loops(), host_.to_state);
  if (!find_integrator(setup.options.integrator).fixed_step) {
    if (members == 1) accuracy_.emplace(setup, rows, loops_.get());
    return;
  }
  for (size_t i = 0; i < members; ++i) fixed_.emplace_back(setup, rows, loops_.get());
}

std::pair<const double*, const double*> ForceWatch::watched(double t, const double* y,
                                                            size_t member) {
  if (!loops_) return {y + member * nq_, rates_in(y) + member * nv_};
  loops_->update(t, y);
  return {loops_->q(), loops_->v()};
}

void ForceWatch::start(double t, const double* y) {
  for (size_t i = 0; i < fixed_.size(); ++i) {
    const auto [q, v] = watched(t, y, i);
    fixed_[i].start(t, q, v);
  }
}

void ForceWatch::evaluated(double t, const double* y, const double* ydot,
                           std::span<const Ending> endings) {
  if (accuracy_) return keep_acting(ydot);
  if (loops_) {
    if (fixed_.empty() || !fixed_[0].begins_step()) return;
    loops_->accelerate(t, y, ydot, forces_.tau(0));
    return fixed_[0].evaluated(t, loops_->dv(), loops_->tau());
  }
  for (size_t i = 0; i < fixed_.size(); ++i)
    if (endings[i].ok()) fixed_[i].evaluated(t, rates_in(ydot) + i * nv_, forces_.tau(i));
}

void ForceWatch::accepted(double t, const double* y, bool breaks, std::span<const Ending> endings) {
  if (accuracy_) weigh(t, y);
  for (size_t i = 0; i < fixed_.size(); ++i)
    if (endings[i].ok()) {
      const auto [q, v] = watched(t, y, i);
      fixed_[i].accepted(t, q, v, breaks);
    }
}

std::string ForceWatch::doubt(size_t member) const {
  if (accuracy_) return accuracy_->doubt();
  if (fixed_.empty()) return {};
  return FixedStepForces::text(*setup_.model, fixed_[member].worst());
}

double ForceWatch::error(size_t member) const {
  if (fixed_.empty()) return 0;
  const ForceDoubt found = fixed_[member].worst();
  return found.row ? found.error / found.largest : 0;
}

void ForceWatch::keep_acting(const double* ydot) {
  acting_.assign(ydot, ydot + size());
  acting_.insert(acting_.end(), forces_.tau(0), forces_.tau(0) + nv_);
}

void ForceWatch::weigh(double t, const double* y) {
  scale_.resize(size());
  host_.error_scale(y, scale_.data());
  const double *ydot = acting_.data(), *tau = ydot + size();
  ForceAccuracy::State state{
      .q = y, .v = rates_in(y), .dv = rates_in(ydot), .tau = tau, .scale = scale_.data()};
  if (const LoopForces* loops = forces_.loops()) {
    closed_.assign(y, y + size());
    host_.to_state(t, closed_.data());
    state.closed_q = closed_.data();
    state.loop_q = loops->near_q();
  }
  if (loops_) {
    loops_->accelerate(t, y, ydot, tau, accuracy_->asks_accelerations());
    state.q = loops_->q();
    state.v = loops_->v();
    state.dv = loops_->dv();
    state.tau = loops_->tau();
  }
  accuracy_->accepted(t, state);
}

void ForceWatch::limit_errors(const double* y, double* allowed) const {
  if (accuracy_) accuracy_->limit_errors(y, rates_in(y), allowed);
}

bool ForceWatch::retakes(double begin, double end, const double* y,
                         const std::function<void(double, double*)>& state) {
  if (!accuracy_) return false;
  if (!loops_) return accuracy_->passes_stop(begin, end, y, rates_in(y), state);
  std::vector<double> at(size());
  const auto with_loops = [&](double t, double* out) {
    state(t, at.data());
    const auto [q, v] = watched(t, at.data(), 0);
    out = std::copy_n(q, loops_->nq(), out);
    std::copy_n(v, loops_->nv(), out);
  };
  watched(end, y, 0);
  const std::vector<double> q(loops_->q(), loops_->q() + loops_->nq()),
      v(loops_->v(), loops_->v() + loops_->nv());
  return accuracy_->passes_stop(begin, end, q.data(), v.data(), with_loops);
}

double ForceWatch::step_limit(double t) {
  if (!accuracy_) return infinity;
  if (!accuracy_->started()) {
    std::vector<double> y(size()), ydot(size());
    host_.evaluate(t, y.data(), ydot.data());
    keep_acting(ydot.data());
    weigh(t, y.data());
  }
  return accuracy_->step_limit(t);
}

}  // namespace linkwise
