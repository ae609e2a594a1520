#include "linkwise/simulate/fixed_step_forces.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace linkwise {
namespace {

/// Errors below this share of the largest force are not told.
constexpr double doubtful = 0.05;
/// An inertia that was found holds while errors do not grow by more than this.
constexpr double growth = 1.25;

bool same_time(double a, double b) {
  return std::abs(a - b) <= 16 * std::numeric_limits<double>::epsilon() * std::abs(b);
}

/// Of what depends on the state; drives' targets and rest positions fall out of differences.
double force(const GainRow& row, double q, double v) {
  double f = row.stiffness * q + row.damping * v;
  if (row.friction > 0) f += row.friction * std::tanh(v / row.friction_velocity);
  if (!(row.stop > 0)) return f;
  const Contact at = contact(row, q, v);
  if (at.depth > 0) f += at.side * stop_stiffness(row, at.speed) * at.depth;
  return f;
}

/// Deepest within a step of length h between two contacts with the same stop, none of which
/// touches.
double deepest_between(const Contact& a, const Contact& b, double h) {
  // The cubic lies within the hull of its four control values.
  if (!(std::max(a.depth + h * a.speed / 3, b.depth - h * b.speed / 3) > 0)) return 0;
  double deepest = 0;
  constexpr int probes = 16;
  for (int k = 1; k < probes; ++k) {
    const double s = static_cast<double>(k) / probes, r = 1 - s;
    deepest = std::max(deepest, r * r * ((1 + 2 * s) * a.depth + s * h * a.speed) +
                                    s * s * ((3 - 2 * s) * b.depth - r * h * b.speed));
  }
  return deepest;
}

}  // namespace

FixedStepForces::FixedStepForces(const Setup& setup, const std::vector<GainRow>& rows,
                                 LoopWatch* loops)
    : setup_(setup),
      loops_(loops),
      nq_(setup.model->nq() + (loops ? setup.model->loops.nq : 0)),
      nv_(setup.model->nv() + (loops ? setup.model->loops.nv : 0)),
      first_order_(find_integrator(setup.options.integrator).highest_order == 1) {
  for (const GainRow& row : rows) rows_.push_back({row});
}

void FixedStepForces::start(double t, const double* q, const double* v) {
  for (Row& row : rows_) row.inertia = row.largest = row.error = row.time = 0;
  end_.t = t;
  end_.q.assign(q, q + nq_);
  end_.v.assign(v, v + nv_);
  end_.known = false;
  fresh_ = complete_ = true;
  breaks_ = false;
}

void FixedStepForces::evaluated(double t, const double* dv, const double* tau) {
  dv_.assign(dv, dv + nv_);
  tau_.assign(tau, tau + nv_);
  evaluated_at_ = t;
  // What begins a step is of the right side of a break.
  if (fresh_ && same_time(t, end_.t)) {
    end_.dv = dv_, end_.tau = tau_, end_.known = true;
    if (!complete_ && !breaks_) judge_step();
    complete_ = true;
  }
  fresh_ = false;
}

void FixedStepForces::accepted(double t, const double* q, const double* v, bool breaks) {
  std::swap(begin_, end_);
  end_.t = t;
  end_.q.assign(q, q + nq_);
  end_.v.assign(v, v + nv_);
  end_.known = !fresh_ && same_time(evaluated_at_, t);
  complete_ = !begin_.known;
  breaks_ = breaks;
  if (end_.known) {
    end_.dv = dv_, end_.tau = tau_;
    if (!complete_) judge_step();
    complete_ = true;
  }
  fresh_ = true;
}

/// From begin_ to end_, both with accelerations.
void FixedStepForces::judge_step() {
  mobilities_.clear();
  const double h = end_.t - begin_.t;
  for (Row& row : rows_) {
    double sum = 0;
    for (int i = row.group; i < row.group + row.width; ++i)
      sum += std::max(begin_.tau[i] * begin_.tau[i], end_.tau[i] * end_.tau[i]);
    const double force = std::sqrt(sum);
    if (force > row.largest && std::isfinite(force)) row.largest = force;
    judge(row, h);
  }
}

void FixedStepForces::judge(Row& row, double h) {
  const int i = row.v;
  const double a0 = begin_.dv[i], a1 = end_.dv[i], v0 = begin_.v[i], v1 = end_.v[i];
  const double slip = v1 - v0 - h / 2 * (a0 + a1);
  double shift = 0, K = row.stiffness, q1 = 0, made = 0;
  if (row.q >= 0) {
    q1 = end_.q[row.q];
    shift = q1 - begin_.q[row.q] - h / 2 * (v0 + v1) + h * h / 12 * (a1 - a0);
  }
  const double begins = row.stop > 0 ? meet(row, h, made, K) : 0;
  // Both ways, because friction saturates.
  const double now = force(row, q1, v1);
  made += std::max(std::abs(force(row, q1 + shift, v1 + slip) - now),
                   std::abs(force(row, q1 - shift, v1 - slip) - now));
  const double brought_to_rest = std::sqrt(std::max(0.0, K)) * std::abs(slip);
  const auto whole = [&](double inertia) {
    return made + brought_to_rest * std::sqrt(inertia) + of_blow(row, begins, h, inertia);
  };
  double error = whole(row.inertia);
  if (row.inertia == 0 ? K > 0 || error > 0 : K > 0 && error > growth * row.error) {
    row.inertia = inertia(row);
    error = whole(row.inertia);
  }
  if (!(error > row.error && std::isfinite(error))) return;
  row.error = error, row.time = end_.t;
  row.steepness = K > 0 && row.inertia > 0 ? h * std::sqrt(K / row.inertia) : 0;
}

/// Adds to K the stiffness of a stop that acts within the step, and to `made` what one that was
/// passed through and left would have pushed. The speed at which one was met; 0: none was.
double FixedStepForces::meet(const Row& row, double h, double& made, double& K) const {
  const Contact before = contact(row, begin_.q[row.q], begin_.v[row.v]);
  const Contact after = contact(row, end_.q[row.q], end_.v[row.v]);
  if (before.depth > 0) {
    K += stop_stiffness(row, before.side == after.side ? after.speed : 0);
    return 0;
  }
  // Also where stages within the step have met it and both ends are free.
  const double speed = std::max(before.speed, after.depth > 0 ? after.speed : 0.0);
  if (after.depth > 0 || before.depth + h * speed > 0) K += stop_stiffness(row, speed);
  if (after.depth > 0) return speed;
  if (before.side == after.side) made += row.stop * deepest_between(before, after, h);
  return 0;
}

/// How wrong the force of a stop may be that was met with such a speed.
double FixedStepForces::of_blow(const Row& row, double speed, double h, double inertia) const {
  const double K = stop_stiffness(row, speed), bend = row.stop_damping * speed;
  if (!(speed > 0 && inertia > 0)) return 0;
  const double x = h * std::sqrt(K / inertia);
  double share = x * x / 8;
  // What damps is taken from the step's begin.
  if (first_order_) share += x / 4 * bend / (1 + bend);
  return speed * std::sqrt(K * inertia) * std::min(1.0, share);
}

/// 1 / (H^-1)_ii at the end of the step, or 0 where nothing moves.
double FixedStepForces::inertia(const Row& row) {
  if (row.closes) return loops_->inertia(row.v);
  if (mobilities_.empty()) {
    if (!mobility_) mobility_ = std::make_unique<Mobility>(setup_.driven());
    const auto found = mobility_->evaluate(end_.q.data());
    mobilities_.assign(found.begin(), found.end());
    mobilities_.resize(setup_.model->nv());
  }
  const double mobility = mobilities_[row.v];
  return mobility > 0 ? 1 / mobility : 0;
}

ForceDoubt FixedStepForces::worst() const {
  ForceDoubt out;
  double ratio = doubtful;
  for (const Row& row : rows_)
    if (row.error > ratio * row.largest && row.error > no_acceleration * row.inertia &&
        row.error > no_force(*setup_.model, row)) {
      ratio = row.error / row.largest;
      out = {&row, row.error, row.largest, row.time};
      // Errors go with the square of the step, once it is of the size of what moves.
      out.step = setup_.options.integration.step *
                 std::min({1.0, row.largest > 0 ? std::sqrt(doubtful / ratio) : 1.0,
                           (first_order_ ? 0.1 : 0.2) / row.steepness});
    }
  return out;
}

std::string FixedStepForces::text(const Model& model, const ForceDoubt& doubt) {
  if (!doubt.row) return {};
  char text[200];
  std::snprintf(
      text, sizeof text,
      "its stop, drive, spring, damping or friction acts faster than fixed steps resolve; "
      "take steps of %.2g s, an integrator that chooses its steps, or make them softer",
      doubt.step);
  return doubt.text(model) + text;
}

}  // namespace linkwise
