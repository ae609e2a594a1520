#include "linkwise/simulate/coasting.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linkwise {
namespace {

constexpr size_t points = 8, fewest_points = 4;
/// A machine that stays this long stands in a singular position, and may leave it in several ways,
/// or its loops are weak for long.
constexpr int most_steps_inside = 20;
/// Gaps and slips that rounding leaves.
constexpr double least_gap = 1e-15;
/// What the constraints demand is followed as long as pivots are larger: four digits remain of it.
constexpr double least_pivot = 1e-8;

double largest(const std::vector<double>& x) {
  double most = 0;
  for (const double own : x) most = std::max(most, std::abs(own));
  return most;
}

}  // namespace

void Coasting::start(int full, double tolerance) {
  full_ = full;
  rank_ = full;
  tolerance_ = tolerance;
  inside_ = remembered_ = follows_ = false;
  steps_inside_ = steps_outside_ = 0;
  known_.clear();
  pivots_.clear();
  passed_ = std::numeric_limits<double>::quiet_NaN();
}

Outcome Coasting::steer(double t, const LoopReport& loops, Outcome outcome, const Aside& aside,
                        std::vector<double>& dv, bool remember) {
  if (outcome != Outcome::converged && outcome != Outcome::singular_position) return outcome;
  full_ = std::max(full_, loops.strong);
  rank_ = std::max(rank_, loops.rank);
  const bool inside = loops.strong < full_;
  if (remember) {
    inside_ = inside;
    remembered_ = (!inside || follows_) && outcome == Outcome::converged;
    if (remembered_) last_ = {t, dv};
    last_pivot_ = {t, inside ? 0 : loops.smallest_pivot};
  }
  if (!inside) return outcome;
  if (follows_) {
    const bool lost = loops.rank < rank_ || loops.smallest_pivot < least_pivot;
    return lost ? Outcome::singular_position : outcome;
  }
  if (!guess(t, aside, expected_)) return outcome;
  if (steps_inside_ > most_steps_inside) return Outcome::singular_position;
  dv = differs(aside, expected_) ? aside.demand : expected_;
  return Outcome::converged;
}

void Coasting::accepted() {
  steps_inside_ = inside_ && !follows_ ? steps_inside_ + 1 : 0;
  steps_outside_ = inside_ ? 0 : steps_outside_ + 1;
  if (steps_outside_ > 1) follows_ = false;  // samples of the step that leaves come later
  find_passage();
  if (!remembered_ || (!known_.empty() && !(last_.t > known_.back().t))) return;
  known_.push_back(last_);
  if (known_.size() > points) known_.pop_front();
}

/// What rounding does to accelerations that the constraints demand. At a distance d from a singular
/// position, which is the root of the least pivot, a gap moves coordinates by 1 / d of it, rates by
/// 1 / d^2 and accelerations by 1 / d^3. In a row of loops all those that are nearly singular add.
double Coasting::noise(const Aside& aside) const {
  if (aside.loops.rank < rank_) return std::numeric_limits<double>::infinity();
  const double size = std::max(aside.fastest * aside.fastest, largest(aside.demand));
  const int weak = std::max(1, full_ - aside.loops.strong);
  return weak * std::max(aside.loops.open, least_gap) * size /
         std::pow(aside.loops.smallest_pivot, 1.5);
}

/// False where nothing is known.
bool Coasting::guess(double t, const Aside& aside, std::vector<double>& dv) const {
  if (aside.beside.empty() && known_.size() < fewest_points) return false;
  dv = aside.beside;
  if (!dv.empty()) return true;
  dv.resize(known_.back().dv.size());
  extrapolate(t, dv);
  return true;
}

/// Whether `other` accelerations differ from those demanded by more than rounding errors and the
/// tolerance do.
bool Coasting::differs(const Aside& aside, const std::vector<double>& other) const {
  if (aside.loops.strong == 0) return false;
  const double within = 30 * noise(aside) + 10 * tolerance_ * std::max(1.0, largest(aside.demand));
  for (size_t i = 0; i < other.size(); ++i)
    if (std::abs(aside.demand[i] - other[i]) > within) return true;
  return false;
}

void Coasting::compare(double t, const Aside& aside) {
  if (aside.loops.strong == 0 || !guess(t, aside, expected_)) return;
  const bool stays =
      steps_inside_ > most_steps_inside && noise(aside) < 1e-3 * largest(aside.demand);
  follows_ = stays || differs(aside, expected_);
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
