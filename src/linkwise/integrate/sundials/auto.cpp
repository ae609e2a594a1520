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

/// Where a step is too long for the method's stability, its iterations diverge: on stiff motions in
/// a third of the steps, on others in less than a hundredth. Then the first race comes early. More
/// failures than steps are those of a method that finds no step at all.
constexpr long telling_failures = 20;
constexpr double telling_share = 0.1, telling_most = 1.0, early = 0.25;

/// After each race that was lost the next one is twice as far away, up to this.
constexpr double most_patience = 8.0;

/// From a cold start, bdf reaches the steps that accuracy allows within this cost: some 40 steps
/// with 2 matrices and 10 factors, doubled; with GMRES, some 30 evaluations in each iteration.
double starting_cost(int n) {
  if (n > sundials::largest_dense_size) return 2500.0;
  return 100.0 + 4.0 * n + 20.0 * sundials::factor_cost(n) + 80.0 * sundials::solution_cost(n);
}

/// Windows hold enough steps for the other method to get going within its share of them. Adams
/// takes longer for that, because its order rises to 12: it gets a longer window and may take the
/// whole cost of it, and its share counts in the second half. Where it has spent half and covered
/// less than a third, it gives up.
double window_cost(int n) { return starting_cost(n) / to_bdf.share; }
constexpr double longer = 2.0, hopeless = 1.0 / 3.0;

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
    std::vector<double> state, times, costs;  ///< costs: until these times
    bool open() const { return !times.empty(); }
    void close() { times.clear(), costs.clear(); }
    void add(double time, double cost) { times.push_back(time), costs.push_back(cost); }
    /// The first step that ends when this share of the cost is spent.
    std::size_t after(double share) const {
      const double cost = costs.front() + share * (costs.back() - costs.front());
      return std::lower_bound(costs.begin(), costs.end(), cost) - costs.begin();
    }
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
  bool iterations_diverge(const IntegratorStatistics& now);
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
  IntegratorStatistics earlier_;         ///< of methods that were at work before, and of races
  double raced_at_ = 0.0;                ///< cost at the last race
  long failures_at_ = 0, steps_at_ = 0;  ///< there, too
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
  failures_at_ = steps_at_ = 0;
  patience_ = 1.0;
  window_.close();
}

void Auto::start(double t0, std::span<const double> y0) {
  if (bdf_) begin(false);
  raced_at_ = 0.0;
  failures_at_ = steps_at_ = 0;
  patience_ = 1.0;
  window_.close();
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
  if (window_.open() && outcome == Outcome::converged)
    window_.add(time(), active_->statistics().cost);
  return outcome;
}

/// Opens the window when a race comes near, and runs the race when it is due.
void Auto::watch() {
  const IntegratorStatistics now = active_->statistics();
  const double cost = now.cost, spent = cost - raced_at_;
  const double usual = window_cost(system_.size());
  double window = bdf_ ? longer * usual : usual;
  double interval = patience_ * usual * rule().share / rule().overhead;
  if (iterations_diverge(now)) {
    window *= std::min(1.0, early * patience_);
    interval = std::min(interval, patience_ * patience_ * early * usual);
  }
  if (spent < interval - window) return;
  if (!window_.open()) {
    window_.state = state();
    window_.add(time(), cost);
  }
  if (spent < interval) return;
  judge(race());
}

/// Since the first failure after the last race.
bool Auto::iterations_diverge(const IntegratorStatistics& now) {
  const long failures = now.nonlinear_failures - failures_at_;
  if (failures == 0) steps_at_ = now.steps;
  const auto steps = static_cast<double>(now.steps - steps_at_);
  return !bdf_ && failures >= telling_failures && failures >= telling_share * steps &&
         failures <= telling_most * steps;
}

Auto::Race Auto::race() {
  const std::vector<double>&times = window_.times, &costs = window_.costs;
  const double begin = times.front(), end = time();
  const std::size_t judged = bdf_ ? window_.after(0.5) : 0;
  const double whole = costs.back() - costs.front(), cost = costs.back() - costs[judged];
  const double allowed = bdf_ ? whole : rule().share * whole;
  Race result;
  // Below this, times cannot be told apart within the window.
  constexpr double rounding = 100.0 * std::numeric_limits<double>::epsilon();
  if (!(end - begin > rounding * std::abs(end))) return result;
  Past past(system_, end);
  const auto other = make(!bdf_, past);
  other->start(begin, window_.state);
  IntegratorStatistics taken;
  double before = 0.0;
  while (other->time() < end && taken.cost < allowed) {
    const bool begun = other->time() >= times[judged];
    const Outcome outcome = other->step(end);
    taken = other->statistics();
    if (!begun) before = taken.cost;
    if (outcome != Outcome::converged) break;
    if (bdf_ && taken.cost > whole / 2 && other->time() < begin + hopeless * (end - begin)) break;
  }
  earlier_.evaluations += taken.evaluations;
  const double own = taken.cost - before;
  result.won = other->time() >= end && own < rule().share * cost;
  result.times_cheaper = cost / std::max(1.0, own);
  const auto steps = std::upper_bound(times.begin(), times.end(), other->time()) - times.begin();
  result.times_fewer_steps =
      static_cast<double>(steps - 1) / static_cast<double>(std::max(1L, taken.steps));
  return result;
}

void Auto::judge(const Race& race) {
  const double t = time();
  const IntegratorStatistics now = active_->statistics();
  raced_at_ = now.cost;
  failures_at_ = now.nonlinear_failures;
  steps_at_ = now.steps;
  window_.close();
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
