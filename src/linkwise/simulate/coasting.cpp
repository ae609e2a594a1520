#include "linkwise/simulate/coasting.hpp"

#include <algorithm>

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
}

Outcome Coasting::steer(double t, const LoopReport& loops, Outcome outcome, std::vector<double>& dv,
                        bool remember) {
  if (outcome != Outcome::converged && outcome != Outcome::singular_position) return outcome;
  full_ = std::max(full_, loops.strong);
  const bool inside = loops.strong < full_;
  if (remember) {
    inside_ = inside;
    remembered_ = !inside && outcome == Outcome::converged;
    if (remembered_) last_ = {t, dv};
  }
  if (!inside || known_.size() < fewest_points) return outcome;
  if (steps_inside_ > most_steps_inside) return Outcome::singular_position;
  extrapolate(t, dv);
  return Outcome::converged;
}

void Coasting::accepted() {
  steps_inside_ = inside_ ? steps_inside_ + 1 : 0;
  if (!remembered_ || (!known_.empty() && !(last_.t > known_.back().t))) return;
  known_.push_back(last_);
  if (known_.size() > points) known_.pop_front();
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
