#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "linkwise/integrate/integrator.hpp"

namespace linkwise {

/// What an error of each component of y is measured by: rtol scale + atol, or less where the system
/// asks for it. Nothing is held better than rounding lets it be: angles after millions of turns.
inline void tolerated_errors(const OdeSystem& system, const IntegratorOptions& options,
                             std::span<const double> y, double* out) {
  constexpr double rounding = 64 * std::numeric_limits<double>::epsilon();
  const double relative =
      options.relative_tolerance > 0.0 ? options.relative_tolerance : options.tolerance;
  const double absolute =
      options.absolute_tolerance > 0.0 ? options.absolute_tolerance : options.tolerance;
  system.error_scale(y.data(), out);
  for (std::size_t i = 0; i < y.size(); ++i) out[i] *= relative;
  for (std::size_t i = 0; i < y.size(); ++i) out[i] += absolute;
  system.limit_errors(y.data(), out);
  for (std::size_t i = 0; i < y.size(); ++i) out[i] = std::max(out[i], rounding * std::abs(y[i]));
}

}  // namespace linkwise
