#include "linkwise/simulate/force_accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

namespace linkwise {
namespace {

/// Of the largest force, what one step's error may make of it.
constexpr double share = 1e-3;
/// The error test is made stricter by this at most: beyond it rounding is near.
constexpr double strictest = 1e-6;
/// As integrators never ask for more.
constexpr double rounding = 64 * std::numeric_limits<double>::epsilon();
/// A stop this many of its own times away is in reach of a step.
constexpr double in_reach = 4;
/// Steps grow tenfold at most, but for the first ones.
constexpr double most_growth = 20;
constexpr int first_steps = 3;
/// A stop that yields as slowly as its damping lets it, 1 + d s near 0, pushes or does not by so
/// much of 1 / d.
constexpr double finest = 1e-2;
/// Of a step that may have passed through a stop.
constexpr int probes = 16, most_retakes = 8;
/// Forces whose errors exceed this share of the largest one are doubted.
constexpr double doubtful = 0.1;

/// What one step may do wrong, of `usual`, where a force of gain `gain` shall be known to a share
/// of `force`.
double allowed_error(double usual, double gain, double force) {
  if (!(gain > 0)) return usual;
  return std::max(strictest * usual, std::min(usual, share * force / gain));
}

}  // namespace

ForceAccuracy::ForceAccuracy(const Setup& setup, std::vector<GainRow> rows, LoopWatch* loops)
    : setup_(setup), loops_(loops), nq_(setup.model->nq()), nv_(setup.model->nv()) {
  const IntegratorOptions& o = setup.options.integration;
  relative_ = o.relative_tolerance > 0 ? o.relative_tolerance : o.tolerance;
  absolute_ = o.absolute_tolerance > 0 ? o.absolute_tolerance : o.tolerance;
  for (const GainRow& row : rows) {
    rows_.push_back({row});
    stops_close_ |= row.closes && row.stop > 0;
  }
  if (setup.driven().n_loops() == 0) return;
  free_ = std::make_unique<FreeMotion>(setup.driven());
  for (Row& row : rows_) row.held = true;
}

Contact ForceAccuracy::contact(const Row& row, const double* q, const double* v) const {
  return linkwise::contact(row, q[row.q], v[row.v]);
}

/// ahead: a stop that is near counts before it is touched.
ForceAccuracy::Gains ForceAccuracy::gains(const Row& row, const double* q, const double* v,
                                          bool ahead) const {
  Gains out{.position = std::abs(row.stiffness), .rate = std::abs(row.damping)};
  if (row.friction > 0) {
    const double c = std::cosh(std::min(std::abs(v[row.v] / row.friction_velocity), 300.0));
    out.rate += row.friction / row.friction_velocity / c / c;
  }
  if (!(row.stop > 0)) return out;
  const Contact at = contact(row, q, v);
  if (!(at.depth > 0) && !(ahead && row.near && at.speed > 0)) return out;
  const double stiffness = stop_stiffness(row, at.speed);
  out.position += stiffness;
  if (at.depth > 0 && row.stop_damping > 0) out.bend = 1 / row.stop_damping;
  if (stiffness > 0) out.rate += row.stop * row.stop_damping * std::max(0.0, at.depth);
  out.coming = std::max(0.0, at.speed) * std::sqrt(stiffness * row.inertia);
  return out;
}

void ForceAccuracy::limit_errors(const double* q, const double* v, double* allowed) const {
  for (const Row& row : rows_) {
    if (row.closes || row.held) continue;
    const Gains g = gains(row, q, v, true);
    const double force = std::max(row.largest, g.coming);
    const auto limit = [&](double& error, double gain) {
      error = allowed_error(error, gain, force);
    };
    const double usual = allowed[nq_ + row.v];
    if (row.q >= 0) limit(allowed[row.q], g.position);
    double& rate = allowed[nq_ + row.v];
    limit(rate, g.rate);
    rate = std::max(strictest * usual, std::min(rate, finest * g.bend));
  }
  for (size_t i = 0; i < limits_.size(); ++i) allowed[i] = std::min(allowed[i], limits_[i]);
}

/// The error of a loop joint's coordinate or rate.
double ForceAccuracy::error_of_slopes(const Row& row, bool of_rate,
                                      const std::function<double(int)>& error) const {
  double sum = 0;
  for (const LoopWatch::Slope& slope : loops_->slopes(row.v)) {
    const double part = (of_rate ? slope.rate : slope.position) * error(slope.of);
    sum += part * part;
  }
  return std::sqrt(sum);
}

void ForceAccuracy::limit_slopes(const Row& row, const State& state) {
  const Gains g = gains(row, state.q, state.v, true);
  const double force = std::max(row.largest, g.coming);
  const auto usual = [&](int i) { return usual_error(state, i); };
  const auto limit = [&](bool of_rate, double gain, double bend) {
    const double now = error_of_slopes(row, of_rate, usual);
    const double wanted = std::min(allowed_error(now, gain, force), bend);
    if (!(wanted < now)) return;
    const auto slopes = loops_->slopes(row.v);
    const double parts = std::sqrt(static_cast<double>(slopes.size()));
    for (const LoopWatch::Slope& slope : slopes) {
      const double z = of_rate ? slope.rate : slope.position;
      if (!(z > 0)) continue;
      const double least = strictest * usual(slope.of);
      limits_[slope.of] = std::min(limits_[slope.of], std::max(least, wanted / (parts * z)));
    }
  };
  limit(true, g.rate, finest * g.bend);
  if (row.q >= 0) limit(false, g.position, infinity);
}

void ForceAccuracy::accepted(double t, const State& state) {
  last_step_ = t - time_;
  time_ = t;
  step_limit_ = infinity;
  mobilities_.clear();
  retakes_ = 0;
  has_jumped_ = false;
  find_held(state);
  for (Row& row : rows_) {
    double force = 0;
    for (int i = row.group; i < row.group + row.width; ++i) force = std::hypot(force, state.tau[i]);
    // Before anything moves, drives may not know yet what they will have to hold.
    if (!started_) {
      row.at_start = inertia(row, state.q);
      force = std::max(force, std::abs(state.dv[row.v]) * row.at_start);
    }
    if (force > row.largest && std::isfinite(force)) row.largest = force;
    if (row.stop > 0) approach(row, t, state);
  }
  if (loops_) limits_.assign(nq_ + nv_, infinity);
  for (const Row& row : rows_)
    if (row.closes && !row.held) limit_slopes(row, state);
  for (Row& row : rows_)
    if (!row.held) measure(row, t, state);
  steps_ = started_ ? steps_ + 1 : 0;
  started_ = true;
}

void ForceAccuracy::find_held(const State& state) {
  if (!free_ || (started_ && steps_ < held_due_)) return;
  held_due_ = started_ ? 2 * std::max(1, steps_) : 1;
  const bool known = free_->evaluate(state.closed_q, state.loop_q);
  bool any = false;
  for (Row& row : rows_) {
    if (!row.held) continue;
    row.held = known && !(row.closes ? loops_->moves(row.v, *free_)
                                     : std::abs(free_->moved()[row.v]) >
                                           FreeMotion::held * free_->largest());
    any |= row.held;
  }
  if (!any) free_.reset();
}

double ForceAccuracy::usual_error(const State& state, int i) const {
  return relative_ * state.scale[i] + absolute_;
}

double ForceAccuracy::usual_position_error(const Row& row, const State& state) const {
  if (!row.closes) return usual_error(state, row.q);
  return error_of_slopes(row, false, [&](int i) { return usual_error(state, i); });
}

/// 1 / (H^-1)_ii, or 0 where nothing moves.
double ForceAccuracy::inertia(const Row& row, const double* q) {
  if (row.closes) return loops_->inertia(row.v);
  if (mobilities_.empty()) {
    if (!mobility_) mobility_ = std::make_unique<Mobility>(setup_.driven());
    const auto found = mobility_->evaluate(q);
    mobilities_.assign(found.begin(), found.end());
    mobilities_.resize(nv_);
  }
  const double mobility = mobilities_[row.v];
  return mobility > 0 ? 1 / mobility : 0;
}

/// Whether a stop that is met with such a speed is seen by the usual error test.
bool ForceAccuracy::is_resolved(const Row& row, double speed, double error) const {
  const double stiffness = stop_stiffness(row, speed);
  const double blow = std::max(0.0, speed) * std::sqrt(stiffness * row.inertia);
  return error * stiffness <= share * std::max(row.largest, blow);
}

bool ForceAccuracy::pushes(const Row& row, const Contact& at) {
  return at.depth > 0 && 1 + row.stop_damping * at.speed > 0;
}

/// Whether a stop is in reach, and how far a step may go towards it.
void ForceAccuracy::approach(Row& row, double t, const State& state) {
  const Contact at = contact(row, state.q, state.v);
  has_jumped_ |= row.near && pushes(row, at) != pushes(row, row.last);
  row.last = at;
  row.usual_error = usual_position_error(row, state);
  const bool was_near = std::exchange(row.near, false);
  double time = 0, speed = at.speed;
  if (at.depth < 0) {
    // As if the acceleration stayed what it is.
    const double square = speed * speed - 2 * at.side * state.dv[row.v] * at.depth;
    if (!(square > 0)) return;
    time = -2 * at.depth / (speed + std::sqrt(square));
    speed = std::sqrt(square);
    if (!(time > 0) || (steps_ > first_steps && time > most_growth * last_step_)) return;
  }
  if (!was_near) row.inertia = inertia(row, state.q);
  if (is_resolved(row, speed, row.usual_error)) return;
  const double stiffness = stop_stiffness(row, speed);
  row.near = time <= in_reach * std::sqrt(row.inertia / stiffness);
  if (!row.near) step_limit_ = std::min(step_limit_, t + time / 2);
}

bool ForceAccuracy::passes_stop(double begin, double end, const double* q, const double* v,
                                const std::function<void(double, double*)>& state) {
  if (begin != time_ || retakes_ >= most_retakes) return false;
  const LoopJoints& loops = setup_.model->loops;
  const int nq = nq_ + (loops_ ? loops.nq : 0);
  sampled_.resize(nq + nv_ + (loops_ ? loops.nv : 0));
  double until = infinity;
  for (Row& row : rows_) {
    if (!(row.stop > 0) || row.last.depth >= 0) continue;
    const Contact after = contact(row, q, v);
    if (!may_meet(row, end - begin, after)) continue;
    if (!row.near) row.inertia = inertia(row, q);
    until = std::min(until, meets_stop(row, begin, end, after, [&](double t) {
                       state(t, sampled_.data());
                       return contact(row, sampled_.data(), sampled_.data() + nq);
                     }));
  }
  if (!(until < end && until > begin + rounding * std::abs(end))) return false;
  retake_until_ = until;
  ++retakes_;
  return true;
}

/// Whether the stop may have been met within a step of length h: the cubic that has its ends lies
/// within the hull of four values.
bool ForceAccuracy::may_meet(const Row& row, double h, const Contact& after) const {
  return after.depth > 0 ||
         std::max(row.last.depth + h * row.last.speed / 3, after.depth - h * after.speed / 3) > 0;
}

/// Where the step has to end instead; infinite where it may stay as it is.
double ForceAccuracy::meets_stop(const Row& row, double begin, double end, const Contact& after,
                                 const std::function<Contact(double)>& at) const {
  const bool passes = after.depth <= 0;
  double deepest = after.depth, time = end;
  for (int k = 1; k < probes && passes; ++k) {
    const double t = begin + k * (end - begin) / probes;
    const double depth = at(t).depth;
    if (depth > deepest) deepest = depth, time = t;
  }
  if (!(deepest > 0)) return infinity;
  double outside = begin, inside = time;
  for (int k = 0; k < 60 && inside - outside > rounding * std::abs(end); ++k) {
    const double middle = outside + (inside - outside) / 2;
    (at(middle).depth > 0 ? inside : outside) = middle;
  }
  // What is near was tested for its stop, and what the usual test resolves would have been seen.
  if (row.near || is_resolved(row, at(outside).speed, row.usual_error))
    return passes ? time : infinity;
  return outside;
}

void ForceAccuracy::measure(Row& row, double t, const State& state) const {
  const Gains g = gains(row, state.q, state.v, false);
  const double force = std::max(row.largest, g.coming);
  double made = 0, of_rounding = 0;
  const auto add = [&](double gain, int i, double value) {
    if (!(gain > 0)) return;
    made += gain * allowed_error(usual_error(state, i), gain, force);
    of_rounding += gain * rounding * std::abs(value);
  };
  const auto add_slopes = [&](double gain, bool of_rate) {
    if (!(gain > 0)) return;
    made += gain * error_of_slopes(row, of_rate, [&](int i) {
              return std::min(usual_error(state, i), limits_[i]);
            });
    of_rounding += gain * rounding * error_of_slopes(row, of_rate, [&](int i) {
                     return std::abs(i < nq_ ? state.q[i] : state.v[i - nq_]);
                   });
  };
  if (row.closes) {
    add_slopes(g.rate, true);
    add_slopes(g.position, false);
  } else {
    add(g.rate, nq_ + row.v, state.v[row.v]);
    if (row.q >= 0) add(g.position, row.q, state.q[row.q]);
  }
  // One component may have the whole of the error, which is a mean square.
  const double components = std::sqrt(nq_ + nv_);
  made = components * std::max(made, of_rounding);
  if (made > row.error)
    row.error = made, row.error_of_rounding = components * of_rounding, row.error_time = t;
}

std::string ForceAccuracy::doubt() const {
  const Row* worst = nullptr;
  double ratio = doubtful;
  for (const Row& row : rows_)
    if (row.largest > 0 && row.error > ratio * row.largest &&
        row.error > no_acceleration * row.at_start && row.error > no_force(*setup_.model, row))
      ratio = row.error / row.largest, worst = &row;
  if (!worst) return {};
  const ForceDoubt found{worst, worst->error, worst->largest, worst->error_time};
  const std::string out =
      found.text(*setup_.model) +
      "so much do its stop, drive, spring, damping or friction make of the error of a step; ";
  if (worst->error_of_rounding > doubtful * worst->largest)
    return out + "no tolerance helps, because it is rounding: make them softer";
  char text[120];
  std::snprintf(text, sizeof text, "a tolerance %.1g times smaller would do, or make them softer",
                ratio / doubtful);
  return out + text;
}

}  // namespace linkwise
