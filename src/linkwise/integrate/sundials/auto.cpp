/// Adams, and backward differentiation where it moves the same motion on at a fraction of the cost.
///
/// A motion is stiff where the method's stability, and not the accuracy asked for, keeps the steps
/// short. That is found by a race: from time to time the other method covers again, aside, the
/// window of time that the present one has just covered. It takes over where it gets to the end at
/// a share of the cost. A race ends when that share is used up, and races are so rare that they
/// cost 2 % of the evaluations at most. All is decided on counts, and a race leaves no trace in
/// what the method at work computes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "linkwise/integrate/integrator.hpp"
#include "linkwise/integrate/sundials/newton_cost.hpp"

namespace linkwise {

using MakeIntegrator = std::unique_ptr<Integrator>(OdeSystem&, const IntegratorOptions&);
MakeIntegrator make_plain_adams, make_bdf;

namespace {

/// When the other method is tried, and when it takes over.
struct Rule {
  double share;     ///< of the cost of the window: with less it takes over
  double overhead;  ///< of races, as a share of all cost
};
/// The two shares are far enough apart for the methods not to take turns without end. Once a motion
/// is stiff a race costs little beside what was saved.
constexpr Rule to_bdf{.share = 0.2, .overhead = 0.02}, to_adams{.share = 0.7, .overhead = 0.05};

/// After each race that was lost the next one is twice as far away, up to this.
constexpr double most_patience = 8.0;

/// From a cold start, bdf reaches the steps that accuracy allows within this cost: some 40 steps
/// with 2 matrices and 10 factors, doubled; with GMRES, some 30 evaluations in each iteration.
double starting_cost(int n) {
  if (n > sundials::largest_dense_size) return 2500.0;
  return 100.0 + 4.0 * n + 20.0 * sundials::factor_cost(n) + 80.0 * sundials::solution_cost(n);
}

/// Windows hold enough steps for the other method to get going within its share of them.
double window_cost(int n) { return starting_cost(n) / to_bdf.share; }

/// The system until a time that it has reached, evaluated aside.
class Past final : public OdeSystem {
 public:
  Past(OdeSystem& system, double end) : system_(system), end_(end) {}

  int size() const override { return system_.size(); }
  int position_size() const override { return system_.position_size(); }
  Outcome evaluate(double t, const double* y, double* ydot) override {
    return system_.evaluate_aside(t, y, ydot);
  }
  void position_rates(const double* q, const double* v, double* qdot) override {
    system_.position_rates(q, v, qdot);
  }
  bool constrained() const override { return system_.constrained(); }
  Outcome project(double t, double* y) override { return system_.project(t, y); }
  void error_scale(const double* y, double* scale) const override { system_.error_scale(y, scale); }
  void limit_errors(const double* y, double* allowed) const override {
    system_.limit_errors(y, allowed);
  }
  double step_limit(double t) override { return std::min(system_.step_limit(t), end_); }
  bool breaks_at(double t) override { return system_.breaks_at(t); }

 private:
  OdeSystem& system_;
  double end_;
};

std::string with_number(const char* format, double number) {
  char text[160];
  std::snprintf(text, sizeof text, format, number);
  return text;
}

class Auto final : public Integrator {
 public:
  /// Where it may not change, it is adams that says when it is not the right choice.
  Auto(bool may_change, OdeSystem& system, const IntegratorOptions& options)
      : may_change_(may_change), max_steps_(options.max_steps), system_(system) {
    options_[0] = options_[1] = options;
    options_[1].max_order = std::min(options.max_order, 5);
    options_[0].max_steps = options_[1].max_steps = 0;
    begin(false);
  }

  void start(double t0, std::span<const double> y0) override;
  Outcome step(double t_limit) override;
  void interpolate(double t, std::span<double> y) override { active_->interpolate(t, y); }
  double time() const override { return active_->time(); }
  IntegratorStatistics statistics() const override;
  std::string stiffness() const override;

 private:
  /// What was covered since a race came near.
  struct Window {
    std::vector<double> state, times;
    double cost = 0.0;  ///< at its begin
    bool open() const { return !times.empty(); }
  };
  struct Race {
    bool won = false;
    double times_cheaper = 0.0;  ///< where won
    double times_fewer_steps = 0.0;
  };

  std::unique_ptr<Integrator> make(bool bdf, OdeSystem& system) const {
    return bdf ? make_bdf(system, options_[1]) : make_plain_adams(system, options_[0]);
  }
  const Rule& rule() const { return bdf_ ? to_adams : to_bdf; }
  std::vector<double> state() const;
  void begin(bool bdf);
  void watch();
  Race race();
  void judge(const Race& race);
  void change_over();
  Outcome try_bdf(double t_limit);

  bool may_change_;
  long max_steps_;
  OdeSystem& system_;
  IntegratorOptions options_[2];  ///< of adams and bdf
  std::unique_ptr<Integrator> active_;
  bool bdf_ = false, watches_ = true;
  IntegratorStatistics earlier_;  ///< of methods that were at work before, and of races
  double raced_at_ = 0.0;         ///< cost at the last race
  double patience_ = 1.0;
  Window window_;
  std::string stiffness_;
  int changes_ = 0;
};

/// Takes a new instance of a method, which is still to be started.
void Auto::begin(bool bdf) {
  bdf_ = bdf;
  active_ = make(bdf, system_);
  raced_at_ = 0.0;
  patience_ = 1.0;
  window_.times.clear();
}

void Auto::start(double t0, std::span<const double> y0) {
  if (bdf_) begin(false);
  raced_at_ = 0.0;
  patience_ = 1.0;
  window_.times.clear();
  earlier_ = {};
  stiffness_.clear();
  changes_ = 0;
  watches_ = true;
  active_->start(t0, y0);
}

std::vector<double> Auto::state() const {
  std::vector<double> y(static_cast<std::size_t>(system_.size()));
  active_->interpolate(time(), y);
  return y;
}

Outcome Auto::step(double t_limit) {
  if (max_steps_ > 0 && statistics().steps >= max_steps_) return Outcome::too_many_steps;
  if (watches_) watch();
  const Outcome outcome = active_->step(t_limit);
  if (outcome == Outcome::step_too_small && may_change_ && !bdf_) return try_bdf(t_limit);
  if (window_.open() && outcome == Outcome::converged) window_.times.push_back(time());
  return outcome;
}

/// Opens the window when a race comes near, and runs the race when it is due.
void Auto::watch() {
  const double cost = active_->statistics().cost, spent = cost - raced_at_;
  const double window = window_cost(system_.size());
  const double interval = patience_ * window * rule().share / rule().overhead;
  if (spent < interval - window) return;
  if (!window_.open()) {
    window_.state = state();
    window_.times.assign(1, time());
    window_.cost = cost;
  }
  if (spent < interval) return;
  judge(race());
}

Auto::Race Auto::race() {
  const double begin = window_.times.front(), end = time();
  const double cost = active_->statistics().cost - window_.cost, allowed = rule().share * cost;
  Race result;
  // Below this, times cannot be told apart within the window.
  constexpr double rounding = 100.0 * std::numeric_limits<double>::epsilon();
  if (!(end - begin > rounding * std::abs(end))) return result;
  Past past(system_, end);
  const auto other = make(!bdf_, past);
  other->start(begin, window_.state);
  IntegratorStatistics taken;
  while (other->time() < end && taken.cost < allowed) {
    const Outcome outcome = other->step(end);
    taken = other->statistics();
    if (outcome != Outcome::converged) break;
  }
  earlier_.evaluations += taken.evaluations;
  result.won = other->time() >= end && taken.cost < allowed;
  result.times_cheaper = cost / std::max(1.0, taken.cost);
  const std::vector<double>& times = window_.times;
  const auto steps = std::upper_bound(times.begin(), times.end(), other->time()) - times.begin();
  result.times_fewer_steps =
      static_cast<double>(steps - 1) / static_cast<double>(std::max(1L, taken.steps));
  return result;
}

void Auto::judge(const Race& race) {
  const double t = time();
  raced_at_ = active_->statistics().cost;
  window_.times.clear();
  patience_ = std::min(2.0 * patience_, most_patience);
  if (race.won && may_change_) {
    if (changes_ == 0)
      stiffness_ =
          with_number("stiff from t = %.4g s on: bdf took over", t) +
          with_number(", at least %.3g times cheaper there than adams", race.times_cheaper);
    return change_over();
  }
  if (bdf_) return;
  if (race.won) {
    watches_ = false;
    stiffness_ =
        with_number("stiff at t = %.4g s", t) +
        with_number(": bdf is at least %.3g times cheaper there than adams", race.times_cheaper) +
        "; with integrator = \"auto\" it takes over by itself";
  } else if (stiffness_.empty() && race.times_fewer_steps > 1.0 / to_bdf.share) {
    stiffness_ = with_number("stiff at t = %.4g s", t) +
                 with_number(": adams takes %.3g times the steps that accuracy needs",
                             race.times_fewer_steps) +
                 ", but bdf costs more with so many unknowns; the run takes long unless drives, "
                 "damping, friction or stops are softer";
  }
}

void Auto::change_over() {
  const double t = time();
  const std::vector<double> y = state();
  earlier_ = statistics();
  begin(!bdf_);
  ++changes_;
  active_->start(t, y);
}

/// Where adams finds no step that is small enough.
Outcome Auto::try_bdf(double t_limit) {
  const double t = time();
  const std::vector<double> y = state();
  const IntegratorStatistics before = earlier_, until_here = statistics();
  std::unique_ptr<Integrator> adams = std::move(active_);
  begin(true);
  earlier_ = until_here;
  active_->start(t, y);
  if (active_->step(t_limit) == Outcome::converged) {
    if (++changes_ == 1)
      stiffness_ = with_number("stiff from t = %.4g s on: bdf took over, because adams found", t) +
                   " no step small enough";
    return Outcome::converged;
  }
  earlier_ = before;
  earlier_.evaluations += active_->statistics().evaluations;
  active_ = std::move(adams);
  bdf_ = false;
  return Outcome::step_too_small;
}

IntegratorStatistics Auto::statistics() const {
  IntegratorStatistics result = active_->statistics();
  result.steps += earlier_.steps;
  result.evaluations += earlier_.evaluations;
  result.error_test_failures += earlier_.error_test_failures;
  result.nonlinear_failures += earlier_.nonlinear_failures;
  result.cost += earlier_.cost;
  return result;
}

std::string Auto::stiffness() const {
  if (changes_ < 2) return stiffness_;
  return stiffness_ + "; adams and bdf took turns, " + std::to_string(changes_) + " changes";
}

}  // namespace

std::unique_ptr<Integrator> make_auto(OdeSystem& system, const IntegratorOptions& options) {
  return std::make_unique<Auto>(true, system, options);
}

std::unique_ptr<Integrator> make_adams(OdeSystem& system, const IntegratorOptions& options) {
  return std::make_unique<Auto>(false, system, options);
}

}  // namespace linkwise
