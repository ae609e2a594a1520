#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "base/draws.hpp"
#include "linkwise/linear/semidefinite.hpp"

namespace linkwise::testing {
namespace {

/// B B^T, B [n][rank].
std::vector<double> semidefinite(int n, int rank, Draws& draws) {
  std::vector<double> B(static_cast<size_t>(n) * rank), A(static_cast<size_t>(n) * n);
  for (double& x : B) x = draws.normal();
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < rank; ++k) A[i * n + j] += B[i * rank + k] * B[j * rank + k];
  return A;
}
std::vector<double> times(int n, const std::vector<double>& A, const std::vector<double>& x) {
  std::vector<double> y(n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) y[i] += A[i * n + j] * x[j];
  return y;
}

// The solution solves, and is orthogonal to every null vector: it is the shortest.
TEST(SemidefiniteFactor, SolvesByTheLeastLength) {
  Draws draws(5);
  for (int n : {1, 2, 5, 13, 40})
    for (int rank : {0, 1, n / 2, n - 1, n}) {
      const std::vector<double> A = semidefinite(n, rank, draws);
      SemidefiniteFactor factor;
      factor.factor(n, A.data(), 1e-11 * n);
      ASSERT_EQ(factor.rank(), rank);
      std::vector<double> some(n), x(n), null(n);
      for (double& s : some) s = draws.normal();
      const std::vector<double> b = times(n, A, some);
      EXPECT_LT(factor.solve(b.data(), x.data()), 1e-10 * n);
      const std::vector<double> got = times(n, A, x);
      for (int i = 0; i < n; ++i) EXPECT_NEAR(got[i], b[i], 1e-10 * n);
      for (int k = 0; k < n - rank; ++k) {
        factor.null_vector(k, null.data());
        for (const double y : times(n, A, null)) EXPECT_NEAR(y, 0, 1e-9);
        double product = 0, length = 0;
        for (int i = 0; i < n; ++i) {
          product += null[i] * x[i];
          length += null[i] * null[i];
        }
        EXPECT_NEAR(product, 0, 1e-9 * std::sqrt(length));
        EXPECT_GT(length, 0.99);
      }
    }
}

TEST(SemidefiniteFactor, TellsByHowMuchEquationsContradict) {
  const std::vector<double> A{2, 2, 2, 2}, b{2, 2.5};
  SemidefiniteFactor factor;
  factor.factor(2, A.data(), 1e-12);
  std::vector<double> x(2);
  EXPECT_NEAR(factor.solve(b.data(), x.data()), 0.5, 1e-15);
  EXPECT_DOUBLE_EQ(factor.smallest_pivot(), 1);
}

}  // namespace
}  // namespace linkwise::testing
