#include "linkwise/solve/energy_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linkwise {

void EnergyEstimate::start(double slowest_contraction) {
  decrease_.resize(window);
  total_ = 0.0;
  slowest_contraction_ = slowest_contraction;
  count_ = 0;
}

void EnergyEstimate::add(double decrease) {
  decrease_[count_ % window] = decrease;
  total_ += decrease;
  ++count_;
}

double EnergyEstimate::contraction() const {
  const int span = std::min(count_ - 1, 3);
  if (span < 1) return std::numeric_limits<double>::infinity();
  const double ratio = at(count_ - 1) / at(count_ - 1 - span);
  return ratio > 0.0 ? std::pow(ratio, 1.0 / span) : 0.0;
}

double EnergyEstimate::squared_error() const {
  if (count_ == 0) return std::numeric_limits<double>::infinity();
  const double last_decrease = std::abs(last());
  if (last_decrease == 0.0) return 0.0;
  const double q = std::max(contraction(), slowest_contraction_);
  if (!(q < 1.0)) return std::numeric_limits<double>::infinity();
  // All decreases that followed decrease j, relative to it; what followed the latest is unknown, so
  // the ratios are lower bounds, and those of the last two digits (1e-4 in the square) are the
  // relevant ones.
  double largest = q / (1.0 - q), followed = last_decrease;
  const int oldest = std::max(0, count_ - window);
  for (int j = count_ - 2; j >= oldest; --j) {
    const double decrease = at(j);
    if (decrease > 0.0) largest = std::max(largest, followed / decrease);
    followed += decrease;
    if (last_decrease < 1e-4 * followed) break;
  }
  return last_decrease * largest;
}

}  // namespace linkwise
