#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/base/finite.hpp"

namespace linkwise {
namespace {

// Wherever it is in a row of any length, among the largest numbers that there are.
TEST(Finite, OneBadNumberIsSeen) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (size_t n = 0; n < 70; ++n) {
    std::vector<double> values(n, std::numeric_limits<double>::max());
    EXPECT_TRUE(all_finite(values)) << n;
    for (size_t i = 0; i < n; ++i)
      for (const double bad : {inf, -inf, std::numeric_limits<double>::quiet_NaN()}) {
        const double good = std::exchange(values[i], bad);
        EXPECT_FALSE(all_finite(values)) << bad << " at " << i << " of " << n;
        values[i] = -good;
      }
  }
}

}  // namespace
}  // namespace linkwise
