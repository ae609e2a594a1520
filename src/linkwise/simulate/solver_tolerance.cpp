#include "linkwise/simulate/solver_tolerance.hpp"

#include <algorithm>
#include <cmath>

namespace linkwise {
namespace {

/// Share of the step's error.
constexpr double share = 0.1;
/// The first steps are tiny and grow a hundredfold within a few steps. The error that such a step
/// allows would be far too large for the steps that build on its accelerations. Measured on the
/// maneuvers of [sharf1993]: with less, errors of the forces change which steps are taken, and the
/// end point is 3 times further off.
constexpr int settling_steps = 10;
constexpr double growth = 100.0;
/// Smallest part of the relative tolerance that is asked for; beyond it rounding is near.
constexpr double least_relative = 0.01;

}  // namespace

SolverTolerance::SolverTolerance(const Model& model, double step_relative, double step_absolute,
                                 double relative)
    : model_(&model),
      mobility_(model),
      step_relative_(step_relative),
      step_absolute_(step_absolute),
      relative_(relative),
      bound_(std::make_shared<EnergyBound>()) {
  start(0);
}

void SolverTolerance::start(double t) {
  *bound_ = {least_relative * relative_, 0.0};
  time_ = t;
  last_step_ = rate_error_ = 0;
  steps_ = 0;
}

void SolverTolerance::accepted(double t, const double* q, const double* v) {
  last_step_ = t - time_;
  time_ = t;
  ++steps_;
  const std::span<const double> mobility = mobility_.evaluate(q);
  double sum = 0;
  for (size_t i = 0; i < mobility.size(); ++i) {
    const double weight = step_relative_ * std::abs(v[i]) + step_absolute_;
    sum += mobility[i] / (weight * weight);
  }
  rate_error_ = std::sqrt(sum / (model_->nq() + model_->nv()));
}

void SolverTolerance::set(double t) {
  // The step before, where it was longer: after a failed step the next ones grow again.
  const double step = std::max(t - time_, last_step_) * (steps_ < settling_steps ? growth : 1.0);
  const double absolute = share / (step * rate_error_);
  bound_->absolute = std::isfinite(absolute) ? absolute : 0.0;
}

}  // namespace linkwise
