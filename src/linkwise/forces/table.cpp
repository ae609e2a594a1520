#include "linkwise/forces/table.hpp"

#include <string>

#include "linkwise/base/error.hpp"
#include "linkwise/base/finite.hpp"

namespace linkwise {

void check_rows(std::span<const double> times, std::span<const double> values) {
  const size_t columns = times.empty() ? 0 : values.size() / times.size();
  if (times.size() < 2)
    throw InputError("times has " + std::to_string(times.size()) +
                     " entries; a table needs at least two times");
  for (size_t i = 0; i < times.size(); ++i) {
    const std::string row = std::to_string(i);
    if (!all_finite(values.subspan(i * columns, columns)))
      throw InputError("values is not finite in row " + row);
    if (!all_finite(times.subspan(i, 1)) || (i > 0 && !(times[i] > times[i - 1])))
      throw InputError("times is not increasing at row " + row +
                       "; sort the table by time and remove repeated times");
  }
}

Table linear_table(std::span<const double> times, std::span<const double> values) {
  const size_t columns = values.size() / times.size();
  Table table;
  table.breaks.assign(times.begin(), times.end());
  table.columns = static_cast<int>(columns);
  for (size_t i = 0; i + 1 < times.size(); ++i) {
    const double *from = values.data() + i * columns, *to = from + columns;
    for (size_t c = 0; c < columns; ++c)
      table.coefficients.push_back((to[c] - from[c]) / (times[i + 1] - times[i]));
    table.coefficients.insert(table.coefficients.end(), from, to);
  }
  return table;
}

Table parabola_table(std::span<const double> times, std::span<const double> values) {
  const size_t columns = values.size() / times.size();
  const double first = times[1] - times[0], second = times[2] - times[1];
  const double* y = values.data();
  std::vector<double> slopes[2], halves;
  for (size_t c = 0; c < columns; ++c) {
    const double before = (y[columns + c] - y[c]) / first;
    const double after = (y[2 * columns + c] - y[columns + c]) / second;
    halves.push_back((after - before) / (first + second));
    slopes[0].push_back(before - halves[c] * first);
    slopes[1].push_back(before + halves[c] * first);
  }
  Table table{{times.begin(), times.end()}, 3, static_cast<int>(columns), {}};
  std::vector<double>& to = table.coefficients;
  for (size_t i = 0; i < 2; ++i) {
    to.insert(to.end(), columns, 0.0);
    to.insert(to.end(), halves.begin(), halves.end());
    to.insert(to.end(), slopes[i].begin(), slopes[i].end());
    to.insert(to.end(), y + i * columns, y + (i + 1) * columns);
  }
  return table;
}

}  // namespace linkwise
