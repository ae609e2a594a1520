#pragma once
// Are all of them numbers? Of results too: sums and products of large inputs overflow.
#include <cstddef>
#include <span>

namespace linkwise {

/// 0 * x is NaN exactly where x is not finite, so one sum decides for all. It is kept in sixteen
/// parts, which vector instructions add at once: one after the other, the results of a chain took a
/// thirteenth of the time in which they are computed.
inline bool all_finite(std::span<const double> values) {
  constexpr std::size_t width = 16;
  double sums[width] = {};
  const double* x = values.data();
  const double* const end = x + values.size();
  for (; static_cast<std::size_t>(end - x) >= width; x += width)
    for (std::size_t k = 0; k < width; ++k) sums[k] += 0.0 * x[k];
  double sum = 0.0;
  for (; x != end; ++x) sum += 0.0 * *x;
  if (values.size() >= width)
    for (const double part : sums) sum += part;
  return sum == 0.0;
}

}  // namespace linkwise
