#include "linkwise/simulate/body_velocity_state.hpp"

#include <algorithm>

namespace linkwise {

BodyVelocityState::BodyVelocityState(const Model& model, const DynamicsOptions& options, Host host)
    : model_(model),
      options_(options),
      host_(std::move(host)),
      velocities_(model, options),
      y_(size()),
      rates_(model.nv()) {}

const std::vector<double>& BodyVelocityState::from_rates(const std::vector<double>& state) {
  const double* q = state.data();
  std::copy_n(q, model_.nq(), y_.begin());
  velocities_.from_rates(q, q + model_.nq(), y_.data() + model_.nq());
  return y_;
}

void BodyVelocityState::interpolate(Integrator& integrator, double t, std::vector<double>& state) {
  integrator.interpolate(t, y_);
  const double *q = y_.data(), *w = q + model_.nq();
  std::copy_n(q, model_.nq(), state.begin());
  drift_ = velocities_.to_rates(q, w, state.data() + model_.nq());
}

Outcome BodyVelocityState::evaluate(double t, const double* y, double* ydot) {
  const double* w = y + model_.nq();
  double* dw = ydot + model_.nq();
  position_rates(y, w, ydot);
  const SweepInput<double> in = host_.input(t, y, rates_.data());
  return host_.judge(
      t, [&] { return velocities_.evaluate(t, in, w, dw); }, dw, velocities_.size());
}

Outcome BodyVelocityState::evaluate_aside(double t, const double* y, double* ydot) {
  if (!aside_) aside_ = std::make_unique<BodyVelocities>(model_, options_);
  const double* w = y + model_.nq();
  position_rates(y, w, ydot);
  const SweepInput<double> in = host_.input(t, y, rates_.data());
  return aside_->evaluate(t, in, w, ydot + model_.nq()).outcome;
}

void BodyVelocityState::position_rates(const double* q, const double* w, double* qdot) {
  velocities_.to_rates(q, w, rates_.data());
  for (const Element& e : model_.elements) element_position_rate(e, q, rates_.data(), qdot);
}

void BodyVelocityState::accepted(double t, const double*) {
  host_.accepted();
  velocities_.accepted(t);
}

}  // namespace linkwise
