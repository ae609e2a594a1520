// Lanes into rows, for any length, any number of lanes in use and any distance between rows.
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/simd/rows.hpp"

namespace linkwise {
namespace {

template <int W>
void check_all() {
  for (size_t n = 0; n <= 3 * W + 1; ++n) {
    std::vector<Lanes<W>> from(n);
    for (size_t k = 0; k < n; ++k)
      for (int l = 0; l < W; ++l) from[k][l] = 1.0 + 100.0 * l + k;
    for (int lanes = 1; lanes <= W; ++lanes)
      for (const size_t stride : {n, n + 3}) {
        std::vector<double> to(W * stride + 1, -1.0), want = to;
        for (int l = 0; l < lanes; ++l)
          for (size_t k = 0; k < n; ++k) want[l * stride + k] = from[k][l];
        lanes_to_rows(from.data(), n, lanes, to.data(), stride);
        ASSERT_EQ(to, want) << W << " wide, " << n << " numbers, " << lanes << " lanes";
      }
  }
}

TEST(Rows, HoldOneLaneEach) {
  check_all<2>();
  check_all<4>();
  check_all<8>();
}

}  // namespace
}  // namespace linkwise
