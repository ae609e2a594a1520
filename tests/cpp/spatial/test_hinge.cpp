// The shortcuts of a hinge's placement against dense 6x6 arithmetic.
#include <string>

#include <gtest/gtest.h>

#include "linkwise/simd/lanes.hpp"
#include "linkwise/spatial/hinge.hpp"
#include "spatial/dense6.hpp"

namespace linkwise::testing {
namespace {

Mat3<double> about_x(double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {{1, 0, 0, 0, c, s, 0, -s, c}};  // parent -> child components
}
Mat3<double> about_z(double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {{c, s, 0, -s, c, 0, 0, 0, 1}};
}

struct Hinge {
  double alpha, a, d, q;
  HingePlacement<double> placement() const { return {std::cos(alpha), std::sin(alpha), a, d}; }
  /// Turn about x, go along x, go along z, turn about z: written out one after the other.
  Transform<double> transform() const {
    const Transform<double> steps[] = {{about_x(alpha), {}},
                                       {Mat3<double>::identity(), {a, 0, 0}},
                                       {Mat3<double>::identity(), {0, 0, d}},
                                       {about_z(q), {}}};
    Transform<double> X{Mat3<double>::identity(), {}};
    for (const auto& step : steps) X = step * X;
    return X;
  }
};

PlanarInertia<double> random_planar(Draws& draws) {
  PlanarInertia<double> Y;
  for (double& x : Y.A.m) x = draws.normal();
  for (double& x : Y.B) x = draws.normal();
  Y.xx = draws.normal();
  Y.xy = draws.normal();
  Y.yy = draws.normal();
  return Y;
}
Dense6 dense(const PlanarInertia<double>& Y) {
  ArticulatedInertia<double> all;
  all.A = Y.A;
  all.B = {{Y.B[0], Y.B[1], 0, Y.B[2], Y.B[3], 0, Y.B[4], Y.B[5], 0}};
  all.C = {{Y.xx, Y.xy, Y.yy, 0, 0, 0}};
  return testing::dense(all);
}

void expect_near(const Dense6& got, const Dense6& want) {
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) EXPECT_NEAR(got[i][j], want[i][j], 1e-13) << i << " " << j;
}
template <class V>
void expect_near(const V& got, const Array6& want) {
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(to_array(got)[i], want[i], 1e-14) << i;
}

TEST(Hinge, EqualsDenseArithmetic) {
  Draws draws(71);
  for (int sample = 0; sample < 20; ++sample) {
    // Planar, crossing and degenerate placements among the general ones.
    const Hinge h{sample % 4 == 1 ? 0 : draws.uniform(-3, 3), sample % 4 == 2 ? 0 : draws.normal(),
                  sample % 4 == 3 ? 0 : draws.normal(), draws.uniform(-3, 3)};
    const double c = std::cos(h.q), s = std::sin(h.q);
    const Dense6 X = testing::dense(h.transform());
    const Motion<double> v{random_vector3(draws), random_vector3(draws)};
    const Force<double> f{random_vector3(draws), random_vector3(draws)};
    const PlanarInertia<double> Y = random_planar(draws);
    const Dense6 at_parent = multiply(transposed(X), multiply(dense(Y), X));
    expect_near(to_child(h.placement(), c, s, v), multiply(X, to_array(v)));
    expect_near(to_parent(h.placement(), c, s, f), multiply(transposed(X), to_array(f)));
    expect_near(testing::dense(to_parent(h.placement(), c, s, Y)), at_parent);
    expect_near(testing::dense(transform_to_parent(h.transform(), Y)), at_parent);
    expect_near(Y * v, multiply(dense(Y), to_array(v)));
    const Transform<double> any{random_rotation(draws), random_vector3(draws)};
    const Dense6 Z = testing::dense(any);
    expect_near(testing::dense(transform_to_parent(any, Y)),
                multiply(transposed(Z), multiply(dense(Y), Z)));
  }
}

TEST(Hinge, LanesEqualScalars) {
  constexpr int W = 4;
  using S = Lanes<W>;
  Draws draws(72);
  const Hinge h{0.4, -0.7, 1.1, 0};
  S c, s;
  PlanarInertia<S> Y;
  Motion<S> v;
  PlanarInertia<double> one[W];
  Motion<double> v_one[W];
  double angle[W];
  for (int l = 0; l < W; ++l) {
    angle[l] = draws.uniform(-3, 3);
    set_lane(c, l, std::cos(angle[l]));
    set_lane(s, l, std::sin(angle[l]));
    one[l] = random_planar(draws);
    v_one[l] = {random_vector3(draws), random_vector3(draws)};
    // Plain aggregates of scalars.
    for (size_t i = 0; i < sizeof(one[l]) / sizeof(double); ++i)
      set_lane(reinterpret_cast<S*>(&Y)[i], l, reinterpret_cast<const double*>(&one[l])[i]);
    for (int i = 0; i < 6; ++i)
      set_lane(reinterpret_cast<S*>(&v)[i], l, reinterpret_cast<const double*>(&v_one[l])[i]);
  }
  const ArticulatedInertia<S> up = to_parent(h.placement(), c, s, Y);
  const auto down = to_array(to_child(h.placement(), c, s, v));
  for (int l = 0; l < W; ++l) {
    const double cosine = std::cos(angle[l]), sine = std::sin(angle[l]);
    const auto want = to_parent(h.placement(), cosine, sine, one[l]);
    const auto want_down = to_array(to_child(h.placement(), cosine, sine, v_one[l]));
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(lane(up.B.m[i], l), want.B.m[i], 1e-14);
    for (int i = 0; i < 6; ++i) {
      EXPECT_NEAR(lane(up.A.m[i], l), want.A.m[i], 1e-14);
      EXPECT_NEAR(lane(up.C.m[i], l), want.C.m[i], 1e-14);
      EXPECT_NEAR(lane(down[i], l), want_down[i], 1e-14);
    }
  }
}

}  // namespace
}  // namespace linkwise::testing
