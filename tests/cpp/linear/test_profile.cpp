#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "base/draws.hpp"
#include "linkwise/linear/profile.hpp"
#include "linkwise/linear/semidefinite.hpp"

namespace linkwise::testing {
namespace {

/// A band of blocks B B^T, each of which covers some rows of the next.
struct Band {
  int n;
  Profile profile;
  std::vector<double> A, dense;

  Band(int blocks, int rank, Draws& draws) : n(3 * blocks + 3) {
    std::vector<int> first(n);
    for (int i = 0; i < n; ++i) first[i] = std::max(0, 3 * (i / 3) - 3);
    profile = Profile(first);
    A.resize(profile.n_entries());
    dense.resize(static_cast<size_t>(n) * n);
    for (int b = 0; b < blocks; ++b)
      for (int k = 0; k < rank; ++k) {
        double column[6];
        for (double& x : column) x = 0.3 * draws.normal();
        for (int i = 0; i < 6; ++i)
          for (int j = 0; j < 6; ++j) {
            const int row = 3 * b + i, other = 3 * b + j;
            dense[row * n + other] += column[i] * column[j];
            if (other <= row) profile.row(A.data(), row)[other] += column[i] * column[j];
          }
      }
  }
};

TEST(Profile, MultipliesAsTheDenseMatrix) {
  Draws draws(2);
  const Band band(5, 4, draws);
  std::vector<double> x(band.n), y(band.n);
  for (double& xi : x) xi = draws.normal();
  multiply(band.profile, band.A.data(), x.data(), y.data());
  for (int i = 0; i < band.n; ++i) {
    double want = 0;
    for (int j = 0; j < band.n; ++j) want += band.dense[i * band.n + j] * x[j];
    EXPECT_NEAR(y[i], want, 1e-14);
  }
}

std::vector<RowBlock> blocks_of(int n) {
  std::vector<RowBlock> blocks;
  for (int row = 0; row < n; row += 3) blocks.push_back({row, 3});
  return blocks;
}

// The rank that pivoting over all rows finds, and a solution, however many null vectors there are.
TEST(ProfileFactor, LeavesDependentRowsOut) {
  Draws draws(5);
  for (const int blocks : {1, 4, 30})
    for (const int rank : {1, 2, 4}) {
      const Band band(blocks, rank, draws);
      SemidefiniteFactor exact;
      exact.factor(band.n, band.dense.data(), 1e-10);
      ProfileFactor factor;
      factor.factor(band.profile, blocks_of(band.n), band.A, 1e-10);
      EXPECT_EQ(factor.rank(), exact.rank());
      EXPECT_EQ(factor.rank_above(1e-10), factor.rank());
      std::vector<double> some(band.n), b(band.n), x(band.n), product(band.n);
      for (double& s : some) s = draws.normal();
      multiply(band.profile, band.A.data(), some.data(), b.data());
      EXPECT_LT(factor.solve(band.profile, band.A, b.data(), x.data()), 1e-12);
      multiply(band.profile, band.A.data(), x.data(), product.data());
      int zeros = 0;
      for (int i = 0; i < band.n; ++i) {
        EXPECT_NEAR(product[i], b[i], 1e-12);
        zeros += x[i] == 0;
      }
      EXPECT_EQ(zeros, band.n - factor.rank());
    }
}

// A block whose first row is nearly null takes another one first.
TEST(ProfileFactor, TellsWeakDirections) {
  const Profile profile({0, 0, 0});
  const double d = 1e-4;  // rows (d, 0), (1, 0), (0, 1e-3)
  const std::vector<double> A{d * d, d, 1, 0, 0, 1e-6}, b{d, 1, 2e-6};
  const std::vector<RowBlock> blocks{{0, 3}};
  ProfileFactor factor;
  factor.factor(profile, blocks, A, 1e-12);
  EXPECT_EQ(factor.rank(), 2);
  EXPECT_EQ(factor.rank_above(1e-5), 1);
  EXPECT_NEAR(factor.smallest_pivot(), 1e-6, 1e-12);
  std::vector<double> x(3);
  EXPECT_LT(factor.solve(profile, A, b.data(), x.data()), 1e-15);
  EXPECT_NEAR(x[2], 2, 1e-9);
  factor.factor(profile, blocks, A, 1e-5);
  EXPECT_NEAR(factor.solve(profile, A, b.data(), x.data()), 2e-6, 1e-12);
  EXPECT_EQ(x[2], 0);
}

// The same solution of least length that pivoting finds, however many null vectors there are.
TEST(ShiftedFactor, GoesToTheLeastLength) {
  Draws draws(3);
  for (const int blocks : {1, 4, 30})
    for (const int rank : {1, 2, 4}) {
      const Band band(blocks, rank, draws);
      SemidefiniteFactor exact;
      exact.factor(band.n, band.dense.data(), 1e-11);
      ShiftedFactor shifted;
      shifted.factor(band.profile, band.A);
      std::vector<double> some(band.n), b(band.n), want(band.n), got(band.n);
      for (double& s : some) s = draws.normal();
      multiply(band.profile, band.A.data(), some.data(), b.data());
      exact.solve(b.data(), want.data());
      EXPECT_LT(shifted.solve(band.profile, band.A, b.data(), got.data()), 1e-12);
      for (int i = 0; i < band.n; ++i) EXPECT_NEAR(got[i], want[i], 3e-6);
    }
}

TEST(ShiftedFactor, TellsWhatCannotBeMet) {
  const Profile profile({0, 0});
  const std::vector<double> A{1, 1, 1}, b{1, 1.5};
  ShiftedFactor factor;
  factor.factor(profile, A);
  std::vector<double> x(2);
  EXPECT_NEAR(factor.solve(profile, A, b.data(), x.data()), 0.25, 1e-8);
}

}  // namespace
}  // namespace linkwise::testing
