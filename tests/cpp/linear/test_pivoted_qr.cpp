#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/linear/pivoted_qr.hpp"

namespace linkwise {
namespace {

std::vector<double> random_numbers(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> x(n);
  for (double& each : x) each = normal(random);
  return x;
}

/// A^T (A x - b), which is 0 at the least squares.
double gradient(int m, int n, const std::vector<double>& A, const std::vector<double>& b,
                const std::vector<double>& x) {
  std::vector<double> miss(m);
  for (int i = 0; i < m; ++i) {
    miss[i] = -b[i];
    for (int j = 0; j < n; ++j) miss[i] += A[i * n + j] * x[j];
  }
  double largest = 0;
  for (int j = 0; j < n; ++j) {
    double sum = 0;
    for (int i = 0; i < m; ++i) sum += A[i * n + j] * miss[i];
    largest = std::max(largest, std::abs(sum));
  }
  return largest;
}

TEST(PivotedQr, SolvesLeastSquares) {
  const int m = 9, n = 4;
  const std::vector<double> A = random_numbers(m * n, 1), b = random_numbers(m, 2);
  PivotedQr qr;
  qr.factor(m, n, A.data(), 1e-12);
  ASSERT_EQ(qr.rank(), n);
  std::vector<double> x(n);
  qr.solve(b.data(), x.data());
  EXPECT_LT(gradient(m, n, A, b, x), 1e-13);
}

TEST(PivotedQr, RowsNineDecadesApartKeepTheirDigits) {
  // Heavy rows hold x + y = 1, light ones x = 2 y: so close to (2/3, 1/3).
  const double heavy = 1e9;
  const std::vector<double> A{1, -2, heavy, heavy, 1, -2}, b{0, heavy, 0};
  PivotedQr qr;
  qr.factor(3, 2, A.data(), 0);
  double x[2];
  qr.solve(b.data(), x);
  EXPECT_NEAR(x[0], 2.0 / 3, 1e-15);
  EXPECT_NEAR(x[1], 1.0 / 3, 1e-15);
}

TEST(PivotedQr, SolvesNormalEquations) {
  const int m = 7, n = 4;
  const std::vector<double> A = random_numbers(m * n, 5), x = random_numbers(n, 6);
  std::vector<double> b(n), found(n);
  for (int i = 0; i < m; ++i) {
    double product = 0;
    for (int j = 0; j < n; ++j) product += A[i * n + j] * x[j];
    for (int j = 0; j < n; ++j) b[j] += A[i * n + j] * product;
  }
  PivotedQr qr;
  qr.factor(m, n, A.data(), 1e-12);
  qr.solve_normal(b.data(), found.data());
  for (int j = 0; j < n; ++j) EXPECT_NEAR(found[j], x[j], 1e-12);
}

TEST(PivotedQr, SplitsColumnsIntoWhatIsSeenAndWhatIsNot) {
  const int m = 6, n = 5, rank = 3;
  const std::vector<double> left = random_numbers(m * rank, 3), right = random_numbers(rank * n, 4);
  std::vector<double> A(m * n);
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < rank; ++k) A[i * n + j] += left[i * rank + k] * right[k * n + j];
  PivotedQr qr;
  qr.factor(m, n, A.data(), 1e-10);
  ASSERT_EQ(qr.rank(), rank);
  const std::vector<double> seen = qr.seen(), unseen = qr.unseen();
  ASSERT_EQ(seen.size(), static_cast<size_t>(rank * n));
  ASSERT_EQ(unseen.size(), static_cast<size_t>((n - rank) * n));
  for (int k = 0; k < n - rank; ++k) {
    for (int i = 0; i < m; ++i) {
      double sum = 0;
      for (int j = 0; j < n; ++j) sum += A[i * n + j] * unseen[k * n + j];
      EXPECT_NEAR(sum, 0, 1e-13);
    }
    for (int l = 0; l < rank; ++l) {
      double sum = 0;
      for (int j = 0; j < n; ++j) sum += seen[l * n + j] * unseen[k * n + j];
      EXPECT_NEAR(sum, 0, 1e-14);
    }
  }
}

}  // namespace
}  // namespace linkwise
