#include <cmath>

#include <gtest/gtest.h>

#include "base/draws.hpp"
#include "linkwise/simd/cholesky.hpp"

namespace linkwise::testing {
namespace {

using Group = Lanes<native_lanes>;

// A = B B^T from entries of the lower triangular B: the product is what the factor must give back.
TEST(Cholesky, SolvesInEveryLane) {
  Draws draws(3);
  for (int n = 1; n <= 6; ++n) {
    Group a[21], x[6], want[6];
    for (int l = 0; l < native_lanes; ++l) {
      double full[6][6] = {}, B[6][6] = {};
      for (int i = 0; i < n; ++i)
        for (int j = 0; j <= i; ++j)
          B[i][j] = i == j ? 2 + std::abs(draws.normal()) : draws.normal();
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
          for (int k = 0; k < n; ++k) full[i][j] += B[i][k] * B[j][k];
      for (int i = 0; i < n; ++i) want[i][l] = draws.normal();
      for (int i = 0; i < n; ++i) {
        double sum = 0;
        for (int j = 0; j < n; ++j) sum += full[i][j] * want[j][l];
        x[i][l] = sum;
        for (int j = 0; j <= i; ++j) a[packed(i, j)][l] = full[i][j];
      }
    }
    ASSERT_TRUE(cholesky_factor(n, a, 1e-13));
    cholesky_solve(n, a, x);
    for (int i = 0; i < n; ++i)
      for (int l = 0; l < native_lanes; ++l) EXPECT_NEAR(x[i][l], want[i][l], 1e-12);
  }
}

TEST(Cholesky, OneLaneThatIsNotPositiveIsSeen) {
  for (int bad = 0; bad < native_lanes; ++bad) {
    Group a[3] = {broadcast<Group>(4), broadcast<Group>(2), broadcast<Group>(5)};
    a[2][bad] = 1;  // the second column is half of the first
    EXPECT_FALSE(cholesky_factor(2, a, 1e-13));
  }
}

}  // namespace
}  // namespace linkwise::testing
