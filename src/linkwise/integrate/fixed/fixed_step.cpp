#include "linkwise/integrate/fixed/fixed_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linkwise/base/assert.hpp"

namespace linkwise {

FixedStep::FixedStep(OdeSystem& system, const IntegratorOptions& options)
    : system_(system), h_(options.step), max_steps_(options.max_steps) {}

void FixedStep::start(double t0, std::span<const double> y0) {
  LINKWISE_ASSERT(y0.size() == system_.size(), "y0 has the length of the system");
  start_time_ = time_ = t0;
  last_step_ = h_;
  whole_steps_ = steps_ = 0;
  renewal_due_ = false;
  on_grid_ = true;
  system_.evaluations = 0;
  y_.assign(y0.begin(), y0.end());
  system_->project(t0, y_.data());
  previous_ = y_;
  next_ = y_;
  prepare();
}

Outcome FixedStep::step(double /*t_limit*/) {
  if (max_steps_ > 0 && steps_ >= max_steps_) return Outcome::too_many_steps;
  const double t_grid = start_time_ + static_cast<double>(whole_steps_ + 1) * h_;
  if (!(t_grid > time_)) return Outcome::step_too_small;
  const double limit = system_.begin_step(time_);
  const double rounding = 16.0 * std::numeric_limits<double>::epsilon() * std::abs(t_grid);
  const bool cut = limit < t_grid - rounding;
  const bool whole = !cut && on_grid_;
  const double t_next = cut ? limit : t_grid;
  if (renewal_due_) renew();
  const double length = whole ? h_ : t_next - time_;
  const Outcome outcome = advance(time_, length);
  if (outcome != Outcome::converged) return outcome;
  previous_.swap(y_);
  y_.swap(next_);
  time_ = t_next;
  last_step_ = length;
  on_grid_ = !cut;
  whole_steps_ += !cut;
  ++steps_;
  renewal_due_ = system_->breaks_at(time_);
  system_->accepted(time_, y_.data());
  return Outcome::converged;
}

void FixedStep::interpolate(double t, std::span<double> y) {
  LINKWISE_ASSERT(y.size() == system_.size(), "y has the length of the system");
  if (steps_ == 0 || t == time_) {
    std::copy(y_.begin(), y_.end(), y.begin());
    return;
  }
  const double s = 1.0 + (t - time_) / last_step_;
  LINKWISE_ASSERT(s > -1e-6 && s < 1.0 + 1e-6, "t lies within the last step");
  interpolate_fraction(s, y);
  system_->project(t, y.data());
}

IntegratorStatistics FixedStep::statistics() const {
  IntegratorStatistics result;
  result.steps = steps_;
  result.evaluations = system_.evaluations;
  result.last_step = steps_ > 0 ? last_step_ : 0.0;
  result.last_order = steps_ > 0 ? order() : 0;
  return result;
}

}  // namespace linkwise
