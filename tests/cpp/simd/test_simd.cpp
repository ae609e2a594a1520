#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "base/draws.hpp"
#include "linkwise/simd/lanes.hpp"
#include "linkwise/simd/sincos.hpp"

namespace linkwise::testing {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// Width 0 stands for plain double.
template <int W>
struct Width {
  static constexpr int lanes = W == 0 ? 1 : W;
};
template <int W>
struct ScalarOf {
  using type = Lanes<W>;
};
template <>
struct ScalarOf<0> {
  using type = double;
};

template <class T>
class Simd : public ::testing::Test {};
template <int W>
class Simd<Width<W>> : public ::testing::Test {
 protected:
  using Scalar = typename ScalarOf<W>::type;
  static constexpr int lanes = Width<W>::lanes;

  struct Pair {
    std::vector<double> sine, cosine;
  };
  /// All of x, `lanes` at a time; the last group is filled up with its last number.
  static Pair run(const std::vector<double>& x) {
    Pair out;
    for (size_t i = 0; i < x.size(); i += lanes) {
      Scalar group{}, sine, cosine;
      for (int l = 0; l < lanes; ++l) set_lane(group, l, x[std::min(i + l, x.size() - 1)]);
      sincos(group, sine, cosine);
      for (int l = 0; l < lanes && i + l < x.size(); ++l) {
        out.sine.push_back(lane(sine, l));
        out.cosine.push_back(lane(cosine, l));
      }
    }
    return out;
  }
};
using Widths = ::testing::Types<Width<0>, Width<1>, Width<2>, Width<4>, Width<8>>;
TYPED_TEST_SUITE(Simd, Widths);

double ulp_error(double x, long double exact) {
  const double size = std::abs(static_cast<double>(exact));
  const double ulp = std::nextafter(size, infinite) - size;
  return static_cast<double>(std::abs(x - exact) / ulp);
}

TYPED_TEST(Simd, LanesAreSetAndReadOneByOne) {
  using S = typename TestFixture::Scalar;
  static_assert(lane_count<S> == TestFixture::lanes);
  S x = broadcast<S>(2.25);
  set_lane(x, TestFixture::lanes - 1, 9.0);
  const S root = square_root(x);
  for (int l = 0; l < TestFixture::lanes; ++l)
    EXPECT_EQ(lane(root, l), l == TestFixture::lanes - 1 ? 3.0 : 1.5);
}

// The C library in long double is the witness, the bounds are those that sincos.hpp states.
TYPED_TEST(Simd, SineAndCosineKeepTheirBoundsInUlp) {
  Draws draws(1);
  std::vector<double> x{0.0, 5e-324, -1e-310, 1e-300, 1e-20, 1e3, -1e3, 1e5, -1e5};
  for (double range : {1e-8, 1e-3, std::numbers::pi / 4, 10.0, 1e3, 1e5})
    for (int i = 0; i < 5000; ++i) x.push_back(draws.uniform(-range, range));
  // Where the reduction cancels, and where the quadrant changes.
  for (int i = 0; i < 4000; ++i) {
    double near = (i < 2000 ? i : draws.below(127000)) * std::numbers::pi / 4;
    for (int step = draws.below(4); step > 0; --step) near = std::nextafter(near, infinite);
    x.push_back(near);
    x.push_back(-near);
  }
  const auto got = this->run(x);
  for (size_t i = 0; i < x.size(); ++i) {
    const long double exact = x[i];
    const double bound = std::abs(x[i]) <= 1e3 ? 1.6 : 2.5;
    ASSERT_LT(ulp_error(got.sine[i], std::sin(exact)), bound) << "sine of " << x[i];
    ASSERT_LT(ulp_error(got.cosine[i], std::cos(exact)), bound) << "cosine of " << x[i];
  }
}

TYPED_TEST(Simd, HugeArgumentsAreTheCLibrarys) {
  const std::vector<double> x{std::nextafter(1e5, infinite),     -1.5e5, 1e10, -1e22, 3e300,
                              std::numeric_limits<double>::max()};
  const auto got = this->run(x);
  for (size_t i = 0; i < x.size(); ++i) {
    EXPECT_EQ(got.sine[i], std::sin(x[i])) << x[i];
    EXPECT_EQ(got.cosine[i], std::cos(x[i])) << x[i];
  }
}

TYPED_TEST(Simd, NotFiniteStaysInItsLane) {
  for (double bad : {infinite, -infinite, not_a_number})
    for (int at = 0; at < TestFixture::lanes; ++at) {
      std::vector<double> x(TestFixture::lanes, 0.5);
      x[at] = bad;
      const auto got = this->run(x);
      for (int l = 0; l < TestFixture::lanes; ++l) {
        EXPECT_EQ(std::isnan(got.sine[l]), l == at);
        EXPECT_EQ(std::isnan(got.cosine[l]), l == at);
        if (l == at) continue;
        EXPECT_NEAR(got.sine[l], std::sin(0.5), 1e-16);
        EXPECT_NEAR(got.cosine[l], std::cos(0.5), 1e-15);
      }
    }
}

}  // namespace
}  // namespace linkwise::testing
