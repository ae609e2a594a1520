#include "linkwise/dynamics/loop_projection.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/kinematics/coupling_states.hpp"

namespace linkwise {
namespace {

/// Gaps below this share of a loop's length are closed: rounding leaves as much.
constexpr double closed = 1e-15;
constexpr int most_steps = 4;
/// Directions that are held by less than the second are left to drift until the machine has left a
/// singular position: what closes them there is not small. Where masses are so unlike that some are
/// never held by more, the last counts. Those below the first are closed only once they are open by
/// more than `drift`. At a distance d from a singular position a rounding error of a gap moves
/// coordinates by 1/d of it, rates by 1/d^2, and accelerations by 1/d^3: closing it on every step
/// is a noise that small tolerances do not bear.
constexpr double faint = 1e-3, weak = 1e-5, null = 1e-12, drift = 1e-11;

}  // namespace

void move_by(const Model& model, const double* du, double* q) {
  double rate[std::max(7, most_coordinates)];
  for (const Element& e : model.elements) {
    Element own = e;  // rates alone, at the front of a small array
    own.q = 0;
    element_position_rate(own, q + e.q, du, rate);
    for (int k = 0; k < e.nq; ++k) q[e.q + k] += rate[k];
    const int quaternion = info_of(e.kind).quaternion;
    if (quaternion < 0) continue;
    double* p = q + e.q + quaternion;
    const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
    for (int k = 0; k < 4; ++k) p[k] /= length;
  }
}

LoopProjection::LoopProjection(const Model& model, bool by_graph)
    : model_(model),
      states_(model),
      asked_(6 * static_cast<size_t>(model.n_loops()) + model.n_couplings()),
      weakest_(weak),
      faintest_(weak),
      du_(model.nv()) {
  if (by_graph)
    graph_ = std::make_unique<LoopedConstraintForce>(model, DynamicsOptions{});
  else if (Piecewise::closes_cheaply(model))
    pieces_ = std::make_unique<Piecewise>(model, DynamicsOptions{});
  else
    recursion_ = std::make_unique<ArticulatedLoops>(model);
}

bool LoopProjection::respond(const double* q, double least, double* du) {
  if (graph_) return graph_->respond(q, asked_.data(), du);
  return pieces_ ? pieces_->respond(q, asked_.data(), least, du)
                 : recursion_->respond(q, asked_.data(), least, du);
}

LoopReport LoopProjection::report_at(const double* q) {
  gap(q);
  close(q, null, du_.data());
  return report();
}

void LoopProjection::find_rank(const double* q, const double* v) {
  LoopReport best = report_at(q);
  std::vector<double> other, aside(model_.nv());
  at_start_ = best.rank;
  double fastest = 0;
  for (int i = 0; i < model_.nv() && v; ++i) fastest = std::max(fastest, std::abs(v[i]));
  for (int way = 0; way < (fastest > 0 ? 4 : 2); ++way) {
    const double beside = way % 2 == 0 ? 0.03 : -0.03;  // rad, or m
    other.assign(q, q + model_.nq());
    // Not coordinates of elastic bodies: they are small, and no rank depends on them.
    for (const Element& e : model_.elements)
      for (int i = e.v; i < e.v + e.nv && !e.prescribed && !is_of_body(e); ++i)
        aside[i] = beside * (way < 2 ? std::cos(2.4 * i) : v[i] / fastest);
    move_by(model_, aside.data(), other.data());
    for (int k = 0; k < 20 && gap(other.data()) > closed; ++k) {
      if (!close(other.data(), null, du_.data())) break;
      move_by(model_, du_.data(), other.data());
    }
    if (!(gap(other.data()) < 1e-11)) continue;
    const LoopReport report = report_at(other.data());  // a long row of loops may stay singular
    if (report.strong > best.strong ||
        (report.strong == best.strong && report.smallest_pivot > best.smallest_pivot))
      best = report;
  }
  full_ = best.strong;
  n_faint_ = best.rank - best.strong;
  faintest_pivot_ = best.smallest_pivot;
  weakest_ = full_ < best.rank ? null : weak;
  faintest_ = std::max(weakest_, std::min(faint, 0.1 * best.smallest_pivot));
}

/// The root of the sum of squares of residuals over their loops' lengths; what would undo them into
/// asked_.
double LoopProjection::miss(const double* q, const double* v) {
  const bool of_rates = v != nullptr;
  double sum = 0;
  for (int l = 0; l < model_.n_loops(); ++l) {
    const LoopState& loop = (*at_)[l];
    const double* residual = of_rates ? loop.slip : loop.gap;
    const LoopMiss miss = miss_of(loop, residual);
    sum += std::pow(miss.shift / loop.length, 2) + std::pow(miss.turn, 2);
    for (int i = 0; i < loop.rows; ++i) asked_[6 * l + i] = -residual[i];
  }
  for (int c = 0; c < model_.n_couplings(); ++c) {
    const Coupling& coupling = model_.couplings[c];
    const CouplingMiss miss = miss_of(coupling, coupled_state(q, v, *at_));
    const double residual = of_rates ? miss.slip : miss.gap;
    sum += residual * residual;
    asked_[6 * static_cast<size_t>(model_.n_loops()) + c] = -residual;
  }
  return std::sqrt(sum);
}

void LoopProjection::find_states(const double* q, const double* v) {
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  in.loop_q = given_.q;
  in.loop_v = given_.v;
  if (pieces_)
    at_ = &pieces_->find_loops(in);
  else
    states_.update(in);
}

double LoopProjection::gap(const double* q) {
  find_states(q, nullptr);
  return miss(q, nullptr);
}

bool LoopProjection::close(const double* q, double least, double* du) {
  return respond(q, least, du);
}

double LoopProjection::slip(const double* q, const double* v) {
  find_states(q, v);
  return miss(q, v);
}

double LoopProjection::stop(const double* q, double least, double* v) {
  const double before = slip(q, v);
  if (before == 0) return before;
  if (!respond(q, least, du_.data())) return NAN;
  for (size_t i = 0; i < du_.size(); ++i) v[i] += du_[i];
  return before;
}

/// Closing a weak direction moves coordinates by its gap over the root of its pivot, which is also
/// how far the machine is from a singular position: the one has to be small beside the other.
double LoopProjection::least_to_close(int stage, double open) const {
  return stage == 0 ? faintest_ : stage == 1 ? weakest_ : std::clamp(10 * open, null, weakest_);
}

Outcome LoopProjection::project(double* q, double* v, bool closely) {
  const double enough = closely ? closed : drift;
  q_.assign(q, q + model_.nq());
  const double start = gap(q_.data());
  if (!std::isfinite(start)) return Outcome::not_finite;
  double open = start;
  for (int stage = 0; stage < 3 && (stage == 0 || open > enough); ++stage) {
    const double least = least_to_close(stage, open);
    for (int k = 0; k < most_steps && open > closed; ++k) {
      if (!close(q_.data(), least, du_.data())) return Outcome::not_positive_definite;
      move_by(model_, du_.data(), q_.data());
      const double before = open;
      open = gap(q_.data());
      if (!(open < 0.5 * before)) break;  // rounding, or what weak directions leave
    }
  }
  if (!(open <= std::max(std::min(2 * start, 1e-8), 1e-10))) return Outcome::singular_position;
  if (v) {
    v_.assign(v, v + model_.nv());
    for (int stage = 0; stage < 3 && (stage == 0 || slip(q_.data(), v_.data()) > enough); ++stage)
      if (!std::isfinite(stop(q_.data(), least_to_close(stage, open), v_.data())))
        return Outcome::not_finite;
    std::copy(v_.begin(), v_.end(), v);
  }
  std::copy(q_.begin(), q_.end(), q);
  return Outcome::converged;
}

}  // namespace linkwise
