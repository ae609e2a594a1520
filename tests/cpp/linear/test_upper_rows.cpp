#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "base/draws.hpp"
#include "linkwise/linear/upper_rows.hpp"

namespace linkwise::testing {
namespace {

/// Columns first[i] to last[i] of each row, as overlapping groups of rows make them.
struct Shape {
  std::vector<int> first, last;
};
Shape overlapping(int n, int reach) {
  Shape shape;
  for (int i = 0; i < n; ++i) {
    shape.first.push_back(std::max(0, i - reach));
    shape.last.push_back(std::min(n - 1, i + reach));
  }
  return shape;
}

// x is known: A x is multiplied out of the entries before the factor takes their place.
TEST(UpperRows, SolveBandsOfAnyWidth) {
  Draws draws(3);
  for (const int n : {1, 2, 3, 6, 15, 40})
    for (const int reach : {0, 1, 3, 7, 39}) {
      const Shape shape = overlapping(n, reach);
      UpperRows rows(shape.first, shape.last);
      rows.clear();
      std::vector<double> x(n), b(n + UpperRows::width), least(n, 1e-9);
      for (double& xi : x) xi = draws.normal();
      for (int i = 0; i < n; ++i)
        for (int j = i; j <= shape.last[i]; ++j) {
          const double a = draws.uniform(-1, 1) + (i == j ? 2.0 * reach + 2 : 0);
          rows.row(i)[j] = a;
          b[i] += a * x[j];
          if (j > i) b[j] += a * x[i];
        }
      ASSERT_TRUE(rows.factor(least.data()));
      rows.solve(b.data());
      for (int i = 0; i < n; ++i) EXPECT_NEAR(b[i], x[i], 1e-12 * (1 + std::abs(x[i])));
    }
}

TEST(UpperRows, ThatDependOnEachOtherAreRefused) {
  const Shape shape = overlapping(3, 2);
  UpperRows rows(shape.first, shape.last);
  for (const double off : {0.5, 1.0}) {  // rows 0 and 2 become the same
    rows.clear();
    for (int i = 0; i < 3; ++i) rows.row(i)[i] = 1;
    rows.row(0)[2] = off;
    const double least[] = {1e-4, 1e-4, 1e-4};
    EXPECT_EQ(rows.factor(least), off < 1);
  }
}

}  // namespace
}  // namespace linkwise::testing
