#include "linkwise/simulate/body_velocity_state.hpp"

namespace linkwise {

Simulation::BodyVelocityState::BodyVelocityState(Simulation& owner)
    : owner_(owner),
      velocities_(owner.setup_->driven(), owner.setup_->options.dynamics),
      y_(size()),
      rates_(owner.nv()) {}

const std::vector<double>& Simulation::BodyVelocityState::start() {
  const double* q = owner_.y_.data();
  std::copy_n(q, owner_.nq(), y_.begin());
  velocities_.from_rates(q, q + owner_.nq(), y_.data() + owner_.nq());
  return y_;
}

double Simulation::BodyVelocityState::interpolate(double t) {
  owner_.integrator_->interpolate(t, y_);
  const double *q = y_.data(), *w = q + owner_.nq();
  std::copy_n(q, owner_.nq(), owner_.y_.begin());
  velocities_.to_rates(q, w, owner_.y_.data() + owner_.nq());
  return velocities_.drift(q, w);
}

Outcome Simulation::BodyVelocityState::evaluate(double t, const double* y, double* ydot) {
  const double* w = y + owner_.nq();
  double* dw = ydot + owner_.nq();
  position_rates(y, w, ydot);
  const SweepInput<double> in = owner_.input(t, y, rates_.data());
  const auto evaluation = [&] { return velocities_.evaluate(t, in, w, dw); };
  const DynamicsReport report = owner_.keeps_trace_ ? owner_.traced(t, evaluation) : evaluation();
  return owner_.judge(t, report, dw, velocities_.size());
}

void Simulation::BodyVelocityState::position_rates(const double* q, const double* w, double* qdot) {
  velocities_.to_rates(q, w, rates_.data());
  owner_.position_rates(q, rates_.data(), qdot);
}

void Simulation::BodyVelocityState::accepted(double t, const double*) {
  if (!owner_.trace_.empty()) owner_.trace_.back().accepted = true;
  velocities_.accepted(t);
}

}  // namespace linkwise
