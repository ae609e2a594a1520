#include "linkwise/simulate/step_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linkwise {
namespace {

/// Times closer than this are one to an integrator.
double rounding(double t) { return 16 * std::numeric_limits<double>::epsilon() * std::abs(t); }

}  // namespace

StepLimits::StepLimits(const std::vector<Breakpoints>& inputs, double t0)
    : inputs_(inputs), t0_(t0), places_(inputs.size()) {}

/// The place of the first breakpoint after t.
size_t StepLimits::next(size_t input, double t) {
  const std::vector<double>& times = inputs_[input].times;
  size_t& place = places_[input];
  const double from = t + rounding(t);
  const auto is_next = [&](size_t k) {
    return (k == 0 || times[k - 1] <= from) && (k == times.size() || times[k] > from);
  };
  for (int tries = 0; tries < 2 && !is_next(place); ++tries)
    place = std::min(place + 1, times.size());
  if (!is_next(place)) place = std::upper_bound(times.begin(), times.end(), from) - times.begin();
  return place;
}

double StepLimits::after(double t) {
  double limit = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < inputs_.size(); ++i) {
    const Breakpoints& input = inputs_[i];
    size_t k = next(i, t);
    if (k < input.times.size() && input.kinds[k] == Breakpoints::Kind::smooth) ++k;
    if (k < input.times.size()) limit = std::min(limit, input.times[k]);
  }
  return limit;
}

bool StepLimits::breaks_at(double t) {
  if (!(t > t0_)) return false;
  for (size_t i = 0; i < inputs_.size(); ++i) {
    const Breakpoints& input = inputs_[i];
    for (size_t k = next(i, t); k-- > 0 && input.times[k] >= t - rounding(t);)
      if (input.kinds[k] == Breakpoints::Kind::jump) return true;
  }
  return false;
}

}  // namespace linkwise
