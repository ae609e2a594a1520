#include "linkwise/simulate/coasting.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linkwise {
namespace {

constexpr size_t points = 8, fewest_points = 4;
/// A machine that stays this long stands in a singular position, and may leave it in several ways.
constexpr int most_steps_inside = 20;

}  // namespace

void Coasting::start(int full) {
  full_ = full;
  inside_ = remembered_ = false;
  steps_inside_ = 0;
  known_.clear();
  pivots_.clear();
  passed_ = std::numeric_limits<double>::quiet_NaN();
}

Outcome Coasting::steer(double t, const LoopReport& loops, Outcome outcome, std::vector<double>& dv,
                        bool remember, bool known) {
  if (outcome != Outcome::converged && outcome != Outcome::singular_position) return outcome;
  full_ = std::max(full_, loops.strong);
  const bool inside = loops.strong < full_;
  if (remember) {
    inside_ = inside;
    remembered_ = !inside && outcome == Outcome::converged;
    if (remembered_) last_ = {t, dv};
    last_pivot_ = {t, inside ? 0 : loops.smallest_pivot};
  }
  if (!inside || (!known && known_.size() < fewest_points)) return outcome;
  if (steps_inside_ > most_steps_inside) return Outcome::singular_position;
  if (known) return Outcome::converged;
  extrapolate(t, dv);
  return Outcome::converged;
}

void Coasting::accepted() {
  steps_inside_ = inside_ ? steps_inside_ + 1 : 0;
  find_passage();
  if (!remembered_ || (!known_.empty() && !(last_.t > known_.back().t))) return;
  known_.push_back(last_);
  if (known_.size() > points) known_.pop_front();
}

/// Where the parabola through the last three pivots comes down to less than a twentieth of the
/// least.
void Coasting::find_passage() {
  if (!pivots_.empty() && !(last_pivot_.t > pivots_.back().t)) return;
  pivots_.push_back(last_pivot_);
  if (pivots_.size() > 3) pivots_.pop_front();
  if (!std::isnan(passed_)) return;
  if (inside_) passed_ = last_pivot_.t;
  if (pivots_.size() < 3) return;
  const Pivot &a = pivots_[0], &b = pivots_[1], &c = pivots_[2];
  const double first = (b.value - a.value) / (b.t - a.t),
               second = (c.value - b.value) / (c.t - b.t), bend = (second - first) / (c.t - a.t);
  if (!(bend > 0)) return;
  const double lowest = (a.t + b.t - first / bend) / 2;
  if (lowest < a.t || lowest > c.t) return;
  const double value = a.value + (lowest - a.t) * (first + bend * (lowest - b.t));
  if (value < 0.05 * std::min({a.value, b.value, c.value})) passed_ = lowest;
}

double Coasting::reaches_back(double t) const {
  if (known_.size() < points) return std::numeric_limits<double>::infinity();
  return steps_inside_ > most_steps_inside / 5 ? 0 : t - known_.front().t;
}

/// By Lagrange's polynomial.
void Coasting::extrapolate(double t, std::vector<double>& dv) const {
  std::fill(dv.begin(), dv.end(), 0.0);
  for (const Known& own : known_) {
    double weight = 1;
    for (const Known& other : known_)
      if (&other != &own) weight *= (t - other.t) / (own.t - other.t);
    for (size_t i = 0; i < dv.size(); ++i) dv[i] += weight * own.dv[i];
  }
}

}  // namespace linkwise
