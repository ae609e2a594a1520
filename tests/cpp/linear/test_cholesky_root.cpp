#include <gtest/gtest.h>

#include "linkwise/linear/block.hpp"

namespace linkwise::testing {
namespace {

// Rank two in three dimensions: the columns are (1, 2, 3) and (0, 1, -1).
TEST(CholeskyRoot, ADependentDirectionGivesAZeroColumn) {
  const double columns[2][3] = {{1, 2, 3}, {0, 1, -1}};
  Block G{}, R;
  for (const auto& c : columns)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) G[6 * i + j] += c[i] * c[j];
  ASSERT_TRUE(cholesky_root(3, G, -1e-12, 1e-14, R));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(R[6 * i], columns[0][i]);
    EXPECT_EQ(R[6 * i + 1], columns[1][i]);
    EXPECT_EQ(R[6 * i + 2], 0);
  }
  G[14] -= 1;
  EXPECT_FALSE(cholesky_root(3, G, -1e-12, 1e-14, R));
  EXPECT_FALSE(cholesky_root(2, Block{}, 1e-300, 0, R)) << "not regular";
}

}  // namespace
}  // namespace linkwise::testing
