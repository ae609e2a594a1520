#pragma once
// A function of time from a table: piecewise polynomials, several columns at once.
#include <algorithm>
#include <span>
#include <vector>

namespace linkwise {

/// On [breaks[i], breaks[i+1]): sum_k c[i][k] (t - breaks[i])^(degree - k), per column. Beyond the
/// first and the last break it is constant or, if extended, the polynomials go on. Coefficients of
/// splines are computed by the caller (a spline library).
struct Table {
  std::vector<double> breaks;
  int degree = 1, columns = 1;
  std::vector<double> coefficients;  ///< [interval][degree + 1][columns], highest power first

  /// out[columns]; derivative of order 0, 1 or 2, zero beyond the ends unless extended.
  void evaluate(double t, double* out, int derivative = 0, bool extended = false) const {
    const double first = breaks.front(), last = breaks.back();
    const bool outside = !extended && (t < first || t > last);
    for (int c = 0; c < columns; ++c) out[c] = 0;
    if (outside && derivative > 0) return;
    if (!extended) t = std::clamp(t, first, last);
    const size_t n = breaks.size() - 1;
    size_t i = std::upper_bound(breaks.begin(), breaks.end(), t) - breaks.begin();
    i = i == 0 ? 0 : std::min(i - 1, n - 1);
    const double x = t - breaks[i];
    const double* row = coefficients.data() + i * (degree + 1) * columns;
    for (int k = 0; k + derivative <= degree; ++k) {
      const int power = degree - k;
      double factor = 1;
      for (int d = 0; d < derivative; ++d) factor *= power - d;
      for (int c = 0; c < columns; ++c) out[c] = out[c] * x + factor * row[k * columns + c];
    }
  }
};

/// InputError, naming the row, unless there are two times at least, they increase, and all values
/// [times][columns] are finite.
void check_rows(std::span<const double> times, std::span<const double> values);
/// Straight lines from row to row.
Table linear_table(std::span<const double> times, std::span<const double> values);
/// The parabola through three rows, in two pieces of degree 3: the not-a-knot spline of so few.
Table parabola_table(std::span<const double> times, std::span<const double> values);

}  // namespace linkwise
