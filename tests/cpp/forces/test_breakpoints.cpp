#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "linkwise/forces/breakpoints.hpp"

namespace linkwise::test {
namespace {

using Kind = Breakpoints::Kind;

Table linear(std::vector<double> times, const std::function<double(double)>& f) {
  Table table;
  for (size_t i = 0; i + 1 < times.size(); ++i) {
    const double a = f(times[i]), b = f(times[i + 1]);
    table.coefficients.insert(table.coefficients.end(), {(b - a) / (times[i + 1] - times[i]), a});
  }
  table.breaks = std::move(times);
  return table;
}

std::vector<double> grid(double end, int intervals) {
  std::vector<double> times;
  for (int i = 0; i <= intervals; ++i) times.push_back(end * i / intervals);
  return times;
}

bool all(const Breakpoints& found, Kind kind) {
  return std::all_of(found.kinds.begin(), found.kinds.end(), [&](Kind k) { return k == kind; });
}

TEST(Breakpoints, OfAConstantAreNone) {
  EXPECT_TRUE(
      find_breakpoints(linear(grid(10, 100), [](double) { return 3; }), {}, 1e-7).times.empty());
}

TEST(Breakpoints, OfAPulseAreItsRows) {
  const Table table =
      linear({0, 5, 5.001, 5.5, 5.501, 10}, [](double t) { return t > 5 && t < 5.501 ? 10 : 0; });
  const Breakpoints found = find_breakpoints(table, {}, 1e-7);
  EXPECT_EQ(found.times, (std::vector<double>{5, 5.001, 5.5, 5.501}));
  EXPECT_TRUE(all(found, Kind::jump));
}

TEST(Breakpoints, OfABlowOfANanosecondAreItsRows) {
  const std::vector<double> times{0, 5, 5 + 1e-11, 5 + 9.9e-10, 5 + 1e-9, 20};
  const Table table = linear(times, [&](double t) { return t > 5 && t < times[4] ? 1e9 : 0; });
  const Breakpoints found = find_breakpoints(table, {}, 1e-7);
  EXPECT_EQ(found.times, (std::vector<double>(times.begin() + 1, times.end() - 1)));
  // Not where it is the rounding of a much larger force.
  const TableAction beside{.least = 1e11};
  EXPECT_TRUE(find_breakpoints(table, beside, 1e-7).times.empty());
}

TEST(Breakpoints, EndsCountWhereTheyAreHeld) {
  const Table table = linear({1, 2}, [](double t) { return t; });
  EXPECT_EQ(find_breakpoints(table, {}, 1e-7).times, (std::vector<double>{1, 2}));
}

TEST(Breakpoints, OfRowsOnASmoothCurveAreFewAndSmooth) {
  for (const int rows : {3000, 30000}) {
    const Table table = linear(grid(30, rows), [](double t) { return std::sin(t); });
    Breakpoints found = find_breakpoints(table, {}, 1e-7);
    EXPECT_LT(found.times.size(), 300) << rows;
    EXPECT_GT(found.times.size(), 60) << rows;
    // Beyond its ends the table is held.
    for (size_t k = 0; k < found.times.size(); ++k)
      EXPECT_EQ(found.kinds[k] == Kind::smooth, found.times[k] > 0 && found.times[k] < 30)
          << rows << " rows, " << found.times[k] << " s";
  }
}

TEST(Breakpoints, OfAShortBumpAmongSmoothRowsAreOnBothSides) {
  const Table table = linear(grid(30, 30000), [](double t) {
    return std::sin(t) + (std::abs(t - 12.0005) < 0.001 ? 1.0 : 0.0);
  });
  const Breakpoints found = find_breakpoints(table, {}, 1e-7);
  const auto jump_within = [&](double from, double to) {
    for (size_t k = 0; k < found.times.size(); ++k)
      if (found.times[k] >= from && found.times[k] <= to && found.kinds[k] != Kind::smooth)
        return true;
    return false;
  };
  EXPECT_TRUE(jump_within(11.997, 12.0));
  EXPECT_TRUE(jump_within(12.001, 12.004));
}

TEST(Breakpoints, OfATargetAreWhereItsRateJumps) {
  const Table table = linear({0, 4, 8}, [](double t) { return t < 4 ? t : 8 - t; });
  TableAction damper{.value = 0, .rate = 2};
  const Breakpoints found = find_breakpoints(table, damper, 1e-7);
  ASSERT_EQ(found.times.front(), 0);
  EXPECT_NE(std::find(found.times.begin(), found.times.end(), 4), found.times.end());
  EXPECT_TRUE(all(found, Kind::jump));
}

}  // namespace
}  // namespace linkwise::test
