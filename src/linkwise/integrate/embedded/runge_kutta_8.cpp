/// The Runge-Kutta method of order 8 by Dormand and Prince [hairer1993]. It keeps no history, so
/// what it computes is independent of what the multistep methods do with theirs: it is their check.
///
/// The error test is CVODE's, on the combination e5^2 / sqrt(e5^2 + e3^2 / 100) of two embedded
/// methods. States are projected after the test. Samples are read off a polynomial of degree 7,
/// which takes three evaluations more in the steps that are asked for one.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "linkwise/base/assert.hpp"
#include "linkwise/integrate/checked_system.hpp"
#include "linkwise/integrate/embedded/runge_kutta_8_coefficients.hpp"
#include "linkwise/integrate/error_scale.hpp"

namespace linkwise {
namespace {

constexpr int end_rate = order_8::stages;

/// Of steps after another: the next one's length from the error, in units of what is tolerated.
double growth(double error) {
  constexpr double safety = 0.9, least = 1.0 / 3.0, most = 6.0;
  return std::clamp(safety * std::pow(error, -1.0 / 8.0), least, most);
}

class RungeKutta8 final : public Integrator {
 public:
  RungeKutta8(OdeSystem& system, const IntegratorOptions& options)
      : system_(system), options_(options) {}

  void start(double t0, std::span<const double> y0) override;
  Outcome step(double t_limit) override;
  void interpolate(double t, std::span<double> y) override;
  double time() const override { return time_; }
  IntegratorStatistics statistics() const override;

 private:
  using Vector = std::vector<double>;

  Outcome begin();
  Outcome attempt(double h, double* error);
  Outcome evaluate(double t, const Vector& y, Vector& rate) {
    return system_.evaluate(t, y.data(), rate.data());
  }
  void add_stages(int s, double h, const Vector& from, Vector& to) const;
  double norm(const Vector& v) const;
  double error_of(double h);
  void make_polynomial();

  CheckedSystem system_;
  IntegratorOptions options_;
  double time_ = 0.0, h_ = 0.0, last_step_ = 0.0;
  bool begins_ = true, polynomial_made_ = false;
  long steps_ = 0, failures_ = 0;
  /// States at time_ and one step before, what is being computed, what is tolerated.
  Vector y_, previous_, next_, tolerated_, work_;
  std::array<Vector, order_8::all_stages> k_;  ///< of the step that ended at time_, k_[0] its begin
  std::array<Vector, 7> polynomial_;
};

void RungeKutta8::start(double t0, std::span<const double> y0) {
  LINKWISE_ASSERT(y0.size() == system_.size(), "y0 has the length of the system");
  time_ = t0;
  y_.assign(y0.begin(), y0.end());
  system_->project(t0, y_.data());
  previous_ = next_ = tolerated_ = work_ = y_;
  for (Vector& k : k_) k.assign(y_.size(), 0.0);
  polynomial_.fill(k_[0]);
  system_.evaluations = steps_ = failures_ = 0;
  begins_ = true;
}

/// The root mean square in units of what is tolerated.
double RungeKutta8::norm(const Vector& v) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < v.size(); ++i) sum += std::pow(v[i] / tolerated_[i], 2);
  return v.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(v.size()));
}

/// The rate at time_ and a first step, as long as a first and a second derivative let it be
/// [hairer1993, II.4].
Outcome RungeKutta8::begin() {
  Outcome outcome = evaluate(time_, y_, k_[end_rate]);
  if (outcome != Outcome::converged) return outcome;
  tolerated_errors(*system_, options_, y_, tolerated_.data());
  const Vector& rate = k_[end_rate];
  const double size = norm(y_), speed = norm(rate);
  double h = size > 1e-5 && speed > 1e-5 ? 0.01 * size / speed : 1e-6;
  if (options_.max_step > 0.0) h = std::min(h, options_.max_step);
  for (std::size_t i = 0; i < y_.size(); ++i) next_[i] = y_[i] + h * rate[i];
  double bend = 0.0;
  if (evaluate(time_ + h, next_, work_) == Outcome::converged) {
    for (std::size_t i = 0; i < y_.size(); ++i) work_[i] = (work_[i] - rate[i]) / h;
    bend = norm(work_);
  }
  const double most = std::max(speed, bend);
  h_ = std::min(100.0 * h, most > 1e-15 ? std::pow(0.01 / most, 1.0 / 8.0) : 1e-3);
  begins_ = false;
  return Outcome::converged;
}

Outcome RungeKutta8::step(double t_limit) {
  if (options_.max_steps > 0 && steps_ >= options_.max_steps) return Outcome::too_many_steps;
  const double from = time_, limit = system_.begin_step(from);
  if (begins_)
    if (const Outcome outcome = begin(); outcome != Outcome::converged) return outcome;
  previous_ = y_;
  k_[0].swap(k_[end_rate]);
  tolerated_errors(*system_, options_, previous_, tolerated_.data());
  Outcome failure = Outcome::step_too_small;
  for (bool first = true;; first = false) {
    if (options_.max_step > 0.0) h_ = std::min(h_, options_.max_step);
    const double wanted = h_;
    const bool cut = time_ + wanted >= limit;
    const double t = cut ? limit : time_ + wanted, h = t - time_;
    if (!(t > time_ + 4.0 * std::numeric_limits<double>::epsilon() * std::abs(time_))) {
      k_[0].swap(k_[end_rate]);
      return failure;
    }
    double error = 0.0;
    if (const Outcome outcome = attempt(h, &error); outcome != Outcome::converged) {
      failure = outcome;
      h_ = 0.25 * h;
      continue;
    }
    h_ = h * growth(error);
    if (!(error <= 1.0)) {
      failure = Outcome::step_too_small;
      ++failures_;
      continue;
    }
    if (!first) h_ = std::min(h_, h);
    if (cut) h_ = std::max(h_, std::min(wanted, 6.0 * h));
    y_.swap(next_);
    time_ = t;
    last_step_ = h;
    break;
  }
  ++steps_;
  polynomial_made_ = false;
  const auto state_at = [this](double at, double* y) { interpolate(at, {y, y_.size()}); };
  if (system_->retakes(from, time_, y_.data(), state_at)) {
    --steps_;
    time_ = from;
    y_ = previous_;
    k_[0].swap(k_[end_rate]);
    return step(t_limit);
  }
  begins_ = time_ == limit && system_->breaks_at(time_);
  system_->accepted(time_, y_.data());
  return Outcome::converged;
}

/// to = from + h times the stages before s, weighed.
void RungeKutta8::add_stages(int s, double h, const Vector& from, Vector& to) const {
  to = from;
  for (int j = 0; j < s; ++j) {
    const double a = h * order_8::stage[s][j];
    if (a == 0.0) continue;
    const Vector& k = k_[static_cast<std::size_t>(j)];
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += a * k[i];
  }
}

/// The projected state a step of length h later into next_, and the rate there. error: of the step,
/// in units of what is tolerated. With more than that, no rate is computed.
Outcome RungeKutta8::attempt(double h, double* error) {
  for (int s = 1; s < order_8::stages; ++s) {
    add_stages(s, h, y_, next_);
    const Outcome outcome = evaluate(time_ + order_8::node[s] * h, next_, k_[s]);
    if (outcome != Outcome::converged) return outcome;
  }
  add_stages(end_rate, h, y_, next_);
  if (!all_finite(next_)) return Outcome::not_finite;
  *error = error_of(h);
  if (!(*error <= 1.0)) return Outcome::converged;
  const Outcome outcome = system_->project(time_ + h, next_.data());
  if (outcome != Outcome::converged) return outcome;
  return evaluate(time_ + h, next_, k_[end_rate]);
}

double RungeKutta8::error_of(double h) {
  double norms[2] = {};
  const double* weights[2] = {order_8::error_5, order_8::error_3};
  for (int e = 0; e < 2; ++e) {
    std::fill(work_.begin(), work_.end(), 0.0);
    for (int j = 0; j < order_8::stages; ++j)
      for (std::size_t i = 0; i < work_.size(); ++i) work_[i] += weights[e][j] * k_[j][i];
    norms[e] = norm(work_);
  }
  const double both = std::hypot(norms[0], 0.1 * norms[1]);
  return both > 0.0 ? h * norms[0] * norms[0] / both : 0.0;
}

/// Of the last step. Its evaluations leave no trace, so steps do not depend on samples.
void RungeKutta8::make_polynomial() {
  const double h = last_step_, begin = time_ - h;
  for (int s = end_rate + 1; s < order_8::all_stages; ++s) {
    add_stages(s, h, previous_, work_);
    system_.evaluate_aside(begin + order_8::node[s] * h, work_.data(), k_[s].data());
  }
  for (std::size_t i = 0; i < y_.size(); ++i) {
    const double moved = y_[i] - previous_[i], from = h * k_[0][i], to = h * k_[end_rate][i];
    polynomial_[0][i] = moved;
    polynomial_[1][i] = from - moved;
    polynomial_[2][i] = 2.0 * moved - (to + from);
    for (int e = 0; e < 4; ++e) {
      double sum = 0.0;
      for (int s = 0; s < order_8::all_stages; ++s) sum += order_8::dense[e][s] * k_[s][i];
      polynomial_[static_cast<std::size_t>(3 + e)][i] = h * sum;
    }
  }
  polynomial_made_ = true;
}

/// y + x (p0 + (1 - x) (p1 + x (p2 + ...))) at the fraction x of the step.
void RungeKutta8::interpolate(double t, std::span<double> y) {
  if (steps_ == 0 || t == time_) {
    std::copy(y_.begin(), y_.end(), y.begin());
    return;
  }
  if (!polynomial_made_) make_polynomial();
  const double x = 1.0 + (t - time_) / last_step_;
  for (std::size_t i = 0; i < y.size(); ++i) {
    double sum = 0.0;
    for (int e = 6; e >= 0; --e)
      sum = (sum + polynomial_[static_cast<std::size_t>(e)][i]) * (e % 2 == 0 ? x : 1.0 - x);
    y[i] = previous_[i] + sum;
  }
  system_->project(t, y.data());
}

IntegratorStatistics RungeKutta8::statistics() const {
  IntegratorStatistics result;
  result.steps = steps_;
  result.evaluations = system_.evaluations;
  result.error_test_failures = failures_;
  result.last_step = steps_ > 0 ? last_step_ : 0.0;
  result.last_order = steps_ > 0 ? 8 : 0;
  result.cost = static_cast<double>(system_.evaluations);
  return result;
}

}  // namespace

std::unique_ptr<Integrator> make_runge_kutta_8(OdeSystem& system,
                                               const IntegratorOptions& options) {
  return std::make_unique<RungeKutta8>(system, options);
}

}  // namespace linkwise
