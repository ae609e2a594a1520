#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/base/symmetric_eigen.hpp"
#include "linkwise/solve/spectrum.hpp"

namespace linkwise::testing {
namespace {

/// All eigenvalues of A~ by dense Jacobi rotations.
std::vector<double> dense_eigenvalues(const BlockTree& tree) {
  ScaledTree scaled;
  EXPECT_TRUE(scaled.prepare(tree));
  const int n = tree.size();
  std::vector<std::vector<double>> a(n, std::vector<double>(n));
  for (int j = 0; j < n; ++j) {
    std::vector<double> e(n, 0.0);
    e[j] = 1.0;
    scaled.multiply(e, a[j]);
  }
  for (int sweep = 0; sweep < 20; ++sweep)
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q) {
        if (std::abs(a[p][q]) < 1e-300) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t =
            (theta >= 0 ? 1.0 : -1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < n; ++k) {
          const double x = a[k][p], y = a[k][q];
          a[k][p] = c * x - s * y;
          a[k][q] = s * x + c * y;
        }
        for (int k = 0; k < n; ++k) {
          const double x = a[p][k], y = a[q][k];
          a[p][k] = c * x - s * y;
          a[q][k] = s * x + c * y;
        }
      }
  std::vector<double> values(n);
  for (int i = 0; i < n; ++i) values[i] = a[i][i];
  std::sort(values.begin(), values.end());
  return values;
}

TEST(Spectrum, LanczosFindsTheExtremeEigenvalues) {
  for (Shape shape : {Shape::chain, Shape::star, Shape::random_tree, Shape::bushy_tree}) {
    const BlockTree tree = random_tree(shape, Dims::mixed, 20, 3);
    const std::vector<double> exact = dense_eigenvalues(tree);
    const Spectrum spectrum = estimate_spectrum(tree);
    EXPECT_TRUE(spectrum.converged);
    EXPECT_NEAR(spectrum.smallest, exact.front(), 2e-3 * exact.front());
    EXPECT_NEAR(spectrum.largest, exact.back(), 2e-3 * exact.back());
    // Along a chain the spectrum is symmetric about 1; a body with k joints allows k.
    if (shape == Shape::chain) {
      EXPECT_NEAR(exact.front() + exact.back(), 2.0, 1e-12);
    }
    ScaledTree scaled;
    ASSERT_TRUE(scaled.prepare(tree));
    EXPECT_LT(exact.back(), scaled.joints_on_a_body());
  }
}

// Condition of the block-Jacobi-scaled A of straight rigid chains: N^2 for spherical joints, N^4
// for parallel hinges.
TEST(Spectrum, ConditionOfRigidChains) {
  const auto condition = [](RodJoint joint, int n) {
    return estimate_spectrum(rod_chain({joint, false, n})).condition();
  };
  EXPECT_NEAR(condition(RodJoint::spherical, 64), 6.6e3, 0.1e3);
  EXPECT_NEAR(condition(RodJoint::spherical, 256), 1.1e5, 0.05e5);
  EXPECT_NEAR(condition(RodJoint::revolute_parallel, 64), 6.5e7, 0.1e7);
}

TEST(Spectrum, OneNodeAndNone) {
  EXPECT_EQ(estimate_spectrum(BlockTree{}).condition(), 1.0);
  const Spectrum one = estimate_spectrum(random_tree(Shape::chain, Dims::five, 1, 3));
  EXPECT_NEAR(one.condition(), 1.0, 1e-12);
  EXPECT_NEAR(one.radius(), 0.0, 1e-12);
}

TEST(Spectrum, OptimalRelaxationKeepsItsDigitsNearTwo) {
  EXPECT_DOUBLE_EQ(optimal_relaxation(1.0), 1.0);
  // 2 - omega = 2 sqrt(2 lambda) for small lambda; formed from mu = 1 - lambda it would be lost.
  EXPECT_NEAR((2.0 - optimal_relaxation(1e-16)) / (2.0 * std::sqrt(2e-16)), 1.0, 1e-6);
}

TEST(Spectrum, AnIndefiniteMatrixIsRefused) {
  BlockTree tree = random_tree(Shape::chain, Dims::five, 4, 3);
  tree.diag[2][0] = -1.0;
  EXPECT_THROW(estimate_spectrum(tree), InputError);
}

TEST(SymmetricEigen, DiagonalisesEverySize) {
  for (int n = 0; n <= 6; ++n) {
    Block a{};
    const std::vector<double> numbers = random_vector(36, 40 + n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j <= i; ++j) a[6 * i + j] = a[6 * j + i] = numbers[6 * i + j];
    const Block original = a;
    std::array<double, 6> values{};
    Block vectors;
    symmetric_eigen<6>(n, a.data(), values.data(), vectors.data());
    for (int k = 0; k < n; ++k)
      for (int i = 0; i < n; ++i) {
        double image = 0.0, overlap = 0.0;
        for (int j = 0; j < n; ++j) {
          image += original[6 * i + j] * vectors[6 * j + k];
          overlap += vectors[6 * j + i] * vectors[6 * j + k];
        }
        EXPECT_NEAR(image, values[k] * vectors[6 * i + k], 1e-13);
        EXPECT_NEAR(overlap, i == k ? 1.0 : 0.0, 1e-13);
      }
  }
}

}  // namespace
}  // namespace linkwise::testing
