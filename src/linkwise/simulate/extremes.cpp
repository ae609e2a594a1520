#include "linkwise/simulate/extremes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

#include "linkwise/simd/lanes.hpp"
#include "linkwise/simulate/given_motion.hpp"

namespace linkwise {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// What is missed of an extreme, relative to it; and to the whole load of its joint.
constexpr double sharpness = 3e-4, sharpness_of_whole = 1e-6;
// A parabola through the ends of three steps tells the bend within one of them about this well.
constexpr double trust = 2;
constexpr int deepest = 8;
// Steps are looked at together, to fill the lanes; a step is halved this often on the average.
constexpr size_t steps_together = 32, halvings = 4;
// Values that share one decision, so that most need no more than a comparison.
constexpr size_t chunk = 64;
// Numbers per block, so that they stay in a cache; steps, so that they fill lanes.
constexpr size_t largest_block = size_t{1} << 16, least_block = 8;

/// How far a parabola rises over the higher of its ends, which are `apart`, where its middle rises
/// over the middle of their chord by `bulge`.
inline double rise(double bulge, double apart) {
  const double part = 1 - apart / (4 * bulge), over = bulge * part * part;
  return 4 * bulge > apart ? over : 0.0;
}

/// How far parabolas through a third value c bulge up and down between a and b, where that is more;
/// `left`, `right`: factors of the differences to it.
void widen(const double* __restrict a, const double* __restrict b, const double* __restrict c,
           double left, double right, size_t n, double* __restrict up, double* __restrict down) {
  for (size_t i = 0; i < n; ++i) {
    const double bulge = right * (b[i] - c[i]) - left * (a[i] - c[i]);
    up[i] = up[i] < bulge ? bulge : up[i];
    down[i] = down[i] < -bulge ? -bulge : down[i];
  }
}

/// Bulges become the values that are reached. Marks those beyond the extremes; whether any is.
bool reach_out(const double* __restrict a, const double* __restrict b,
               const double* __restrict least, const double* __restrict largest, size_t n,
               double* __restrict up, double* __restrict down, std::int64_t* __restrict beyond) {
  std::int64_t any = 0;
  for (size_t i = 0; i < n; ++i) {
    const double high = a[i] > b[i] ? a[i] : b[i], low = a[i] < b[i] ? a[i] : b[i];
    up[i] = high + rise(up[i], high - low);
    down[i] = low - rise(down[i], high - low);
    beyond[i] = std::int64_t{up[i] > largest[i]} | std::int64_t{down[i] < least[i]};
    any |= beyond[i];
  }
  return any != 0;
}

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

LW_INLINE double length(const double* a) {
  const double square = dot(a, a);
  if (square > 1e-200 && square < 1e200) [[likely]]
    return std::sqrt(square);
  return std::hypot(a[0], a[1], a[2]);  // where squares overflow or vanish
}

/// Length, part along the axis, length of the part across it.
void resolve(const double* vector, const double* axis, double* size, double* along,
             double* across) {
  *size = length(vector);
  *along = dot(vector, axis);
  double rest[3];
  for (int i = 0; i < 3; ++i) rest[i] = vector[i] - *along * axis[i];
  *across = length(rest);
}

/// As many systems as fill the lanes, where most of them would be filled.
size_t filled(size_t n) {
  const size_t rest = n % native_lanes;
  return 4 * rest > native_lanes ? n - rest + native_lanes : n;
}

/// A few roundings from t, as integrators evaluate beside a break.
double beside(double t, double towards) {
  for (int k = 0; k < 4; ++k) t = std::nextafter(t, towards);
  return t;
}

double* row(std::vector<double>& rows, size_t k, size_t n) { return rows.data() + k * n; }

}  // namespace

Extremes::Extremes(const Setup& setup, const double* constant, std::span<const double> directions)
    : setup_(&setup),
      model_(setup.model.get()),
      forces_(setup, 1, constant),
      dynamics_(std::make_shared<BatchEvaluator>(setup.driven())),
      directions_(directions.begin(), directions.end()),
      width_(width(*model_)),
      least_{std::vector<double>(width_, infinity), std::vector<double>(width_, nan),
             std::vector<double>(width_, infinity),
             std::vector<double>(6 * n_derived * joints(*model_), nan)},
      largest_{std::vector<double>(width_, -infinity), least_.time,
               std::vector<double>(width_, -infinity), least_.wrench},
      states_(2 * joints(*model_) * state_size(*model_), nan),
      margin_(width_) {
  if (setup.any_given()) inverse_ = std::make_shared<BatchEvaluator>(*model_);
  // Functions of the caller's are asked while the step is the last one.
  block_ = setup.calls_functions() ? 1
                                   : std::clamp(largest_block / std::max<size_t>(width_, 1),
                                                least_block, steps_together);
}

void Extremes::begin(double t, const double* q, const double* v) {
  time_ = t;
  ends_.push_back({append(t, q, v), {}});
}

void Extremes::add_step(const double* q_middle, const double* v_middle, double t, const double* q,
                        const double* v, bool breaks) {
  std::vector<double> middle(q_middle, q_middle + model_->nq());
  middle.insert(middle.end(), v_middle, v_middle + model_->nv());
  ends_.push_back({append(breaks ? beside(t, -infinity) : t, q, v), std::move(middle)});
  if (breaks) ends_.push_back({append(beside(t, infinity), q, v), {}});
  time_ = t;
  if (ends_.size() - seen_ >= block_) digest(false);
}

size_t Extremes::append(double t, const double* q, const double* v) {
  points_.t.push_back(t);
  points_.q.insert(points_.q.end(), q, q + model_->nq());
  points_.v.insert(points_.v.end(), v, v + model_->nv());
  points_.a.resize(points_.v.size());
  // Rows of values are written before they are read.
  if (points_.values.size() < points_.t.size() * width_)
    points_.values.resize(points_.t.size() * width_);
  return points_.t.size() - 1;
}

size_t Extremes::append_given(size_t left, size_t right, const std::vector<double>& state) {
  const double t = points_.t[left] + (points_.t[right] - points_.t[left]) / 2;
  return append(t, state.data(), state.data() + model_->nq());
}

/// By the cubics through states and rates at both ends.
size_t Extremes::append_middle(size_t left, size_t right) {
  const size_t nq = model_->nq(), nv = model_->nv();
  const double h = points_.t[right] - points_.t[left];
  std::vector<double> q(nq), v(nv), rate_left(nq), rate_right(nq);
  for (const Element& e : model_->elements) {
    element_position_rate(e, row(points_.q, left, nq), row(points_.v, left, nv), rate_left.data());
    element_position_rate(e, row(points_.q, right, nq), row(points_.v, right, nv),
                          rate_right.data());
  }
  const auto cubic = [&](double a, double b, double a_rate, double b_rate) {
    return (a + b) / 2 + h / 8 * (a_rate - b_rate);
  };
  for (size_t i = 0; i < nq; ++i)
    q[i] = cubic(row(points_.q, left, nq)[i], row(points_.q, right, nq)[i], rate_left[i],
                 rate_right[i]);
  for (size_t i = 0; i < nv; ++i)
    v[i] = cubic(row(points_.v, left, nv)[i], row(points_.v, right, nv)[i],
                 row(points_.a, left, nv)[i], row(points_.a, right, nv)[i]);
  normalise_quaternions(*model_, q.data());
  if (evaluation_.close) evaluation_.close(points_.t[left] + h / 2, q.data(), v.data());
  return append(points_.t[left] + h / 2, q.data(), v.data());
}

/// Evaluates rows; those that have no accelerations keep values that are not a number.
void Extremes::evaluate(std::span<const size_t> rows) {
  if (rows.empty()) return;
  if (evaluation_.evaluate) return evaluate_each(rows);
  const size_t n = rows.size(), nq = model_->nq(), nv = model_->nv(), n_load = 6 * joints(*model_);
  const bool outside = !setup_->wrenches.empty(), given = setup_->any_given();
  const size_t systems = filled(n);
  Systems& s = systems_;
  s.resize(systems, nq, nv, n_load);
  for (size_t k = 0; k < n; ++k) {
    double *q = row(s.q, k, nq), *v = row(s.v, k, nv);
    std::copy_n(row(points_.q, rows[k], nq), nq, q);
    std::copy_n(row(points_.v, rows[k], nv), nv, v);
    if (setup_->any_motion())
      impose_motion(*model_, setup_->drives, points_.t[rows[k]], q, v, row(s.given, k, nv));
    forces_.evaluate(points_.t[rows[k]], q, v);
    std::copy_n(forces_.tau(0), nv, row(s.tau, k, nv));
    std::copy_n(forces_.drive(0), nv, row(s.drive, k, nv));
    if (outside) std::copy_n(forces_.external(0), n_load, row(s.external, k, n_load));
  }
  for (size_t k = n; k < systems; ++k) s.repeat(n - 1, k, nq, nv, n_load);
  BatchInput in;
  in.q = s.q.data();
  in.v = s.v.data();
  in.tau = s.tau.data();
  in.prescribed = given ? s.given.data() : nullptr;
  in.external = outside ? s.external.data() : nullptr;
  if (dynamics_->forward_dynamics(systems, in, s.du.data(), s.loads.data()) >= 0)
    for (size_t k = 0; k < n; ++k)
      if (dynamics_->forward_dynamics(1, in.from(*model_, k), row(s.du, k, nv),
                                      row(s.loads, k, n_load)) >= 0) {
        std::fill_n(row(s.du, k, nv), nv, nan);
        std::fill_n(row(s.loads, k, n_load), n_load, nan);
      }
  if (given) {
    in.du = s.du.data();
    inverse_->inverse_dynamics(systems, in, s.total.data(), nullptr);
    for (size_t k = 0; k < n; ++k)
      forces_.add_holding_torques(row(s.total, k, nv), row(s.tau, k, nv), row(s.drive, k, nv));
  }
  for (size_t k = 0; k < n; ++k) {
    std::copy_n(row(s.q, k, nq), nq, row(points_.q, rows[k], nq));
    std::copy_n(row(s.v, k, nv), nv, row(points_.v, rows[k], nv));
    std::copy_n(row(s.du, k, nv), nv, row(points_.a, rows[k], nv));
    write_values(rows[k], row(s.loads, k, n_load), row(s.drive, k, nv));
  }
}

void Extremes::evaluate_each(std::span<const size_t> rows) {
  const size_t nq = model_->nq(), nv = model_->nv(), n_load = 6 * joints(*model_);
  Systems& s = systems_;
  s.resize(1, nq, nv, n_load);
  for (const size_t at : rows) {
    double* du = row(points_.a, at, nv);
    if (!evaluation_.evaluate(points_.t[at], row(points_.q, at, nq), row(points_.v, at, nv), du,
                              s.loads.data(), s.drive.data())) {
      std::fill_n(du, nv, nan);
      std::fill(s.loads.begin(), s.loads.end(), nan);
    }
    write_values(at, s.loads.data(), s.drive.data());
  }
}

void Extremes::Systems::resize(size_t n, size_t nq, size_t nv, size_t n_load) {
  q.resize(n * nq);
  for (auto* rates : {&v, &tau, &drive, &du, &total}) rates->resize(n * nv);
  given.assign(n * nv, 0.0);
  for (auto* wrenches : {&external, &loads}) wrenches->resize(n * n_load);
}

void Extremes::Systems::repeat(size_t from, size_t to, size_t nq, size_t nv, size_t n_load) {
  std::copy_n(row(q, from, nq), nq, row(q, to, nq));
  for (auto* rates : {&v, &tau, &given})
    std::copy_n(row(*rates, from, nv), nv, row(*rates, to, nv));
  std::copy_n(row(external, from, n_load), n_load, row(external, to, n_load));
}

void Extremes::write_values(size_t at, const double* loads, const double* drive) {
  const size_t nj = joints(*model_), nq = model_->nq(), nv = model_->nv();
  double* out = row(points_.values, at, width_);
  const double* v = row(points_.v, at, nv);
  for (size_t j = 0; j < nj; ++j) {
    const double *load = loads + 6 * j, *axis = directions_.data() + 3 * j;
    const auto derived = [&](Derived d) { return out + d * nj + j; };
    resolve(load, axis, derived(force), derived(axial), derived(radial));
    resolve(load + 3, axis, derived(moment), derived(torque), derived(tilting_moment));
    double power = 0;
    if (j < static_cast<size_t>(model_->n_joints())) {
      const JointInfo& info = model_->joints[j];
      for (int i = info.v; i < info.v + info.nv; ++i) power += drive[i] * v[i];
    } else if (evaluation_.power) {
      power = evaluation_.power(static_cast<int>(j) - model_->n_joints());
    }
    *derived(drive_power) = power;
  }
  out = std::copy_n(loads, 6 * nj, out + n_derived * nj);
  out = std::copy_n(row(points_.q, at, nq), nq, out);
  out = std::copy_n(v, nv, out);
  out = std::copy_n(row(points_.a, at, nv), nv, out);
  std::copy_n(drive, nv, out);
}

/// Takes what goes beyond the extremes; of several rows the one that goes farthest, and the first
/// of equals.
void Extremes::keep(std::span<const size_t> rows) {
  const size_t nj = joints(*model_), derived = n_derived * nj;
  const auto take = [&](Extreme& extreme, size_t c, size_t at) {
    const double* values = row(points_.values, at, width_);
    extreme.value[c] = values[c];
    extreme.time[c] = points_.t[at];
    if (c < derived) std::copy_n(values + derived + 6 * (c % nj), 6, row(extreme.wrench, c, 6));
  };
  constexpr std::int64_t none = -1;
  for_chunks([&](size_t begin, size_t end) {
    double low[chunk], high[chunk];
    std::int64_t lowest[chunk], highest[chunk];
    const size_t n = end - begin;
    std::copy_n(least_.value.data() + begin, n, low);
    std::copy_n(largest_.value.data() + begin, n, high);
    std::fill_n(lowest, n, none);
    std::fill_n(highest, n, none);
    for (const size_t at : rows) {
      const double* values = row(points_.values, at, width_) + begin;
      const auto own = static_cast<std::int64_t>(at);
      for (size_t i = 0; i < n; ++i) {
        const double value = values[i];
        lowest[i] = value < low[i] ? own : lowest[i];
        low[i] = value < low[i] ? value : low[i];
        highest[i] = value > high[i] ? own : highest[i];
        high[i] = value > high[i] ? value : high[i];
      }
    }
    for (size_t i = 0; i < n; ++i) {
      const size_t c = begin + i;
      if (lowest[i] != none) take(least_, c, static_cast<size_t>(lowest[i]));
      if (highest[i] == none) continue;
      const auto at = static_cast<size_t>(highest[i]);
      take(largest_, c, at);
      if (c < derived) keep_state(c, row(points_.values, at, width_) + derived + 6 * nj);
    }
  });
}

/// Of the force and the moment of a joint: this is the motion at their new maximum.
void Extremes::keep_state(size_t value, const double* motion) {
  const size_t nj = joints(*model_), n = state_size(*model_);
  const size_t derived = value / nj;
  if (derived != force && derived != moment) return;
  std::copy_n(motion, n, row(states_, (derived == moment ? nj : 0) + value % nj, n));
}

/// f(begin, end) for parts of the values that are worth one decision.
template <class F>
void Extremes::for_chunks(F&& f) const {
  for (size_t begin = 0; begin < width_; begin += chunk) f(begin, std::min(begin + chunk, width_));
}

/// By how much an extreme must be exceeded to be looked for. What is below the error test's
/// absolute tolerance, and loads that are nothing beside the whole load of their joint, are noise.
void Extremes::measure() {
  const size_t nj = joints(*model_), derived = n_derived * nj;
  const IntegratorOptions& o = setup_->options.integration;
  const double floor = o.absolute_tolerance > 0 ? o.absolute_tolerance : o.tolerance;
  for (size_t c = 0; c < width_; ++c)
    margin_[c] = sharpness * std::max(std::abs(least_.value[c]), std::abs(largest_.value[c]));
  for (size_t c = derived + 6 * nj; c < width_; ++c) margin_[c] += floor;
  for (size_t j = 0; j < nj; ++j) {
    const auto whole = [&](Derived d) { return sharpness_of_whole * largest_.value[d * nj + j]; };
    for (const Derived d : {force, axial, radial}) margin_[d * nj + j] += whole(force);
    for (const Derived d : {moment, tilting_moment, torque}) margin_[d * nj + j] += whole(moment);
    margin_[drive_power * nj + j] += floor * whole(moment) / sharpness_of_whole;
    for (size_t i = 0; i < 6; ++i) margin_[derived + 6 * j + i] += whole(i < 3 ? force : moment);
  }
}

/// Writes into near_ which values the interval may bring beyond their extremes, as parabolas say
/// that go through its ends and each of the neighbouring rows.
void Extremes::find_near(size_t left, size_t right, std::span<const size_t> neighbours) {
  const double* a = row(points_.values, left, width_);
  const double* b = row(points_.values, right, width_);
  near_.clear();
  for_chunks([&](size_t begin, size_t end) {
    const size_t n = end - begin;
    double up[chunk] = {}, down[chunk] = {};
    for (const size_t other : neighbours) {
      const Bend bend = bend_of(left, right, other);
      widen(a + begin, b + begin, row(points_.values, other, width_) + begin, trust * bend.a,
            trust * bend.b, n, up, down);
    }
    std::int64_t beyond[chunk];
    if (!reach_out(a + begin, b + begin, least_.value.data() + begin, largest_.value.data() + begin,
                   n, up, down, beyond))
      return;
    for (size_t k = 0; k < n; ++k)
      if (beyond[k]) near_.push_back({begin + k, up[k], down[k]});
  });
}

/// The same of a half of an interval that may bring `values` there; other: the end of the other.
void Extremes::find_near(size_t left, size_t right, size_t other,
                         const std::vector<size_t>& values) {
  const double* a = row(points_.values, left, width_);
  const double* b = row(points_.values, right, width_);
  const double* c = row(points_.values, other, width_);
  const Bend bend = bend_of(left, right, other);
  near_.clear();
  for (const size_t i : values) {
    const double bulge = bend.b * (b[i] - c[i]) - bend.a * (a[i] - c[i]);
    add_near(i, a[i], b[i], std::max(bulge, 0.0), std::max(-bulge, 0.0));
  }
}

/// Factors of the differences to a third row in how far the parabola's middle is over its chord.
Extremes::Bend Extremes::bend_of(size_t left, size_t right, size_t other) const {
  const double quarter = (points_.t[right] - points_.t[left]) / 4;
  return {-quarter / (points_.t[left] - points_.t[other]),
          -quarter / (points_.t[right] - points_.t[other])};
}

void Extremes::add_near(size_t value, double a, double b, double bulge_up, double bulge_down) {
  const double apart = std::abs(b - a);
  const double up = std::max(a, b) + rise(bulge_up, apart);
  const double down = std::min(a, b) - rise(bulge_down, apart);
  if (up > largest_.value[value] || down < least_.value[value]) near_.push_back({value, up, down});
}

/// Whether one of near_ exceeds its extreme by more than its margin.
bool Extremes::is_worth_a_search() const {
  return std::any_of(near_.begin(), near_.end(), [&](const Near& at) {
    const double margin = margin_[at.value];
    return at.up > largest_.value[at.value] + margin || at.down < least_.value[at.value] - margin;
  });
}

/// What near_ may hold stays unknown.
void Extremes::leave_open() {
  for (const Near& at : near_) {
    if (at.up > largest_.reach[at.value]) largest_.reach[at.value] = at.up;
    if (at.down < least_.reach[at.value]) least_.reach[at.value] = at.down;
  }
}

std::vector<size_t> Extremes::near_values() const {
  std::vector<size_t> values;
  for (const Near& at : near_) values.push_back(at.value);
  return values;
}

void Extremes::digest(bool all) {
  std::vector<size_t> rows;
  for (size_t k = seen_; k < ends_.size(); ++k) rows.push_back(ends_[k].row);
  evaluate(rows);
  keep(rows);
  seen_ = ends_.size();
  measure();
  std::vector<Interval> open;
  for (; judged_ + 1 < ends_.size(); ++judged_) {
    const size_t k = judged_, next = k + 2;
    if (ends_[k + 1].apart()) continue;
    if (next >= ends_.size() && !all) break;
    std::vector<size_t> neighbours;
    if (!ends_[k].apart()) neighbours.push_back(ends_[k - 1].row);
    if (next < ends_.size() && !ends_[next].apart()) neighbours.push_back(ends_[next].row);
    const size_t left = ends_[k].row, right = ends_[k + 1].row;
    if (neighbours.empty()) {  // nothing is known of this step
      open.push_back({left, append_given(left, right, ends_[k + 1].middle), right, {}});
      open.back().values.resize(width_);
      std::iota(open.back().values.begin(), open.back().values.end(), size_t{0});
      continue;
    }
    find_near(left, right, neighbours);
    if (is_worth_a_search())
      open.push_back({left, append_given(left, right, ends_[k + 1].middle), right, near_values()});
    else
      leave_open();
  }
  search_inside(std::move(open));
  forget();
}

/// Halves intervals as long as they may hold more. Where noise bends everything, a bound on the
/// work ends it, and the extremes' reach says so.
void Extremes::search_inside(std::vector<Interval> open) {
  size_t left_to_do = halvings * (steps_together + block_);
  for (int depth = 1; !open.empty(); ++depth) {
    std::vector<size_t> rows;
    for (const Interval& interval : open) rows.push_back(interval.middle);
    evaluate(rows);
    keep(rows);
    measure();
    left_to_do -= std::min(left_to_do, open.size());
    std::vector<Interval> next;
    for (const Interval& i : open) {
      const bool narrow = points_.t[i.right] - points_.t[i.left] <=
                          64 * std::numeric_limits<double>::epsilon() * std::abs(points_.t[i.left]);
      const auto half = [&](size_t left, size_t right, size_t other) {
        find_near(left, right, other, i.values);
        if (depth < deepest && !narrow && next.size() < left_to_do && is_worth_a_search())
          next.push_back({left, append_middle(left, right), right, near_values()});
        else
          leave_open();
      };
      half(i.left, i.middle, i.right);
      half(i.middle, i.right, i.left);
    }
    open = std::move(next);
  }
}

/// Keeps what later intervals need: the last three ends, whose rows go to the front.
void Extremes::forget() {
  const size_t first = ends_.size() - std::min<size_t>(ends_.size(), 3);
  ends_.erase(ends_.begin(), ends_.begin() + static_cast<std::ptrdiff_t>(first));
  const size_t kept = ends_.size(), nq = model_->nq(), nv = model_->nv();
  for (size_t k = 0; k < kept; ++k) {  // rows of ends increase, so none is overwritten before
    const size_t at = std::exchange(ends_[k].row, k);
    const auto move = [&](std::vector<double>& rows, size_t n) {
      std::copy_n(row(rows, at, n), n, row(rows, k, n));
    };
    move(points_.t, 1);
    move(points_.q, nq);
    move(points_.v, nv);
    move(points_.a, nv);
    move(points_.values, width_);
  }
  points_.t.resize(kept);
  points_.q.resize(kept * nq);
  points_.v.resize(kept * nv);
  points_.a.resize(kept * nv);
  judged_ -= first;
  seen_ = kept;
}

void Extremes::leave_loads_open() {
  const size_t loads = (n_derived + 6) * joints(*model_);
  std::fill_n(least_.reach.begin(), loads, -infinity);
  std::fill_n(largest_.reach.begin(), loads, infinity);
}

void Extremes::trim() { points_.values.resize(points_.t.size() * width_); }

std::vector<double> Extremes::found() && {
  digest(true);
  std::vector<double> out;
  out.reserve(size(*model_));
  for (Extreme* extreme : {&least_, &largest_}) {
    for (size_t c = 0; c < width_; ++c) {
      const double value = extreme->value[c];
      double& reach = extreme->reach[c];
      reach = extreme == &least_ ? std::min(reach, value) : std::max(reach, value);
      if (!std::isfinite(value)) extreme->value[c] = reach = nan;
    }
    for (const auto* part : {&extreme->value, &extreme->time, &extreme->reach})
      out.insert(out.end(), part->begin(), part->end());
  }
  for (const Extreme* extreme : {&least_, &largest_})
    out.insert(out.end(), extreme->wrench.begin(), extreme->wrench.end());
  out.insert(out.end(), states_.begin(), states_.end());
  return out;
}

}  // namespace linkwise
