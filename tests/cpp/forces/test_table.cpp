#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "base/draws.hpp"
#include "base/error_of.hpp"
#include "linkwise/forces/table.hpp"

namespace linkwise::testing {
namespace {

/// sum_k c_k (t - break)^(degree - k), differentiated term by term.
double direct(const Table& table, size_t interval, int column, double t, int derivative) {
  double sum = 0;
  for (int k = 0; k <= table.degree; ++k) {
    const int power = table.degree - k;
    double factor = 1;
    for (int d = 0; d < derivative; ++d) factor *= power - d;
    if (power < derivative) continue;
    sum += factor *
           table.coefficients[(interval * (table.degree + 1) + k) * table.columns + column] *
           std::pow(t - table.breaks[interval], power - derivative);
  }
  return sum;
}

Table random_table(int degree, int columns, std::vector<double> breaks) {
  Draws draws(degree * 10 + columns);
  Table table{std::move(breaks), degree, columns, {}};
  table.coefficients.resize((table.breaks.size() - 1) * (degree + 1) * columns);
  for (double& c : table.coefficients) c = draws.normal();
  return table;
}

TEST(Table, IsItsPolynomialsInsideAndConstantOutside) {
  for (int degree : {0, 1, 3})
    for (int columns : {1, 2, 6}) {
      const Table table = random_table(degree, columns, {-1, 0.5, 0.75, 3});
      std::vector<double> out(columns);
      for (int derivative : {0, 1, 2})
        for (double t = -1; t <= 3; t += 0.0625) {
          const size_t interval = t < 0.5 ? 0 : t < 0.75 ? 1 : 2;
          table.evaluate(t, out.data(), derivative);
          for (int c = 0; c < columns; ++c)
            EXPECT_NEAR(out[c], direct(table, interval, c, t, derivative), 1e-13) << t;
        }
      for (double t : {-std::numeric_limits<double>::infinity(), -1.001, 3.001, 1e300}) {
        table.evaluate(t, out.data());
        for (int c = 0; c < columns; ++c)
          EXPECT_NEAR(out[c], direct(table, t < 0 ? 0 : 2, c, t < 0 ? -1 : 3, 0), 1e-13);
        table.evaluate(t, out.data(), 1);
        for (int c = 0; c < columns; ++c) EXPECT_EQ(out[c], 0);
      }
      for (double t : {-2.5, -1.001, 3.001, 4.5})  // extended: the outer polynomials go on
        for (int derivative : {0, 1, 2}) {
          table.evaluate(t, out.data(), derivative, true);
          for (int c = 0; c < columns; ++c)
            EXPECT_NEAR(out[c], direct(table, t < 0 ? 0 : 2, c, t, derivative), 1e-12) << t;
        }
    }
}

TEST(Table, LinearInterpolationByHand) {
  // (0, 1), (2, 5), (3, 5)
  const Table table{{0, 2, 3}, 1, 1, {2, 1, 0, 5}};
  const double times[] = {-1, 0, 1, 2, 2.5, 3, 9}, values[] = {1, 1, 3, 5, 5, 5, 5};
  for (int i = 0; i < 7; ++i) {
    double value, rate;
    table.evaluate(times[i], &value);
    table.evaluate(times[i], &rate, 1);
    EXPECT_DOUBLE_EQ(value, values[i]);
    EXPECT_DOUBLE_EQ(rate, times[i] >= 0 && times[i] < 2 ? 2 : 0);
  }
}

TEST(Table, StraightLinesMeetTheirRows) {
  const std::vector<double> times{0, 0.5, 2}, rows{1, -1, 3, 4, 0, 5};
  const Table table = linear_table(times, rows);
  std::vector<double> out(2);
  for (size_t i = 0; i < times.size(); ++i) {
    table.evaluate(times[i], out.data());
    EXPECT_DOUBLE_EQ(out[0], rows[2 * i]);
    EXPECT_DOUBLE_EQ(out[1], rows[2 * i + 1]);
  }
  table.evaluate(1.25, out.data());
  EXPECT_DOUBLE_EQ(out[0], 1.5);
  EXPECT_DOUBLE_EQ(out[1], 4.5);
}

TEST(Table, ThreeRowsLieOnOneParabola) {
  // 2 t^2 - 3 t + 1 and -t^2 + 4, at times that are very uneven
  const auto first = [](double t) { return 2 * t * t - 3 * t + 1; };
  const auto second = [](double t) { return 4 - t * t; };
  const std::vector<double> times{-1, -0.999, 2};
  std::vector<double> rows;
  for (double t : times) rows.insert(rows.end(), {first(t), second(t)});
  const Table table = parabola_table(times, rows);
  std::vector<double> out(2);
  for (double t = -1; t <= 2; t += 0.125) {
    table.evaluate(t, out.data());
    EXPECT_NEAR(out[0], first(t), 1e-11);
    EXPECT_NEAR(out[1], second(t), 1e-11);
    table.evaluate(t, out.data(), 1);
    EXPECT_NEAR(out[0], 4 * t - 3, 1e-11);
  }
}

TEST(Table, RowsThatAreNoneAreNamed) {
  const auto refused = [](std::vector<double> times, std::vector<double> values) {
    return error_of([&] { check_rows(times, values); });
  };
  EXPECT_EQ(refused({0}, {1}), "times has 1 entries; a table needs at least two times");
  EXPECT_EQ(refused({0, 1}, {1, 2, std::nan(""), 4}), "values is not finite in row 1");
  EXPECT_EQ(refused({0, 1, 1}, {1, 2, 3}),
            "times is not increasing at row 2; sort the table by time and remove repeated times");
  EXPECT_EQ(refused({0, std::nan("")}, {1, 2}),
            "times is not increasing at row 1; sort the table by time and remove repeated times");
}

}  // namespace
}  // namespace linkwise::testing
