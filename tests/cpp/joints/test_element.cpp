#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/joints/element.hpp"
#include "spatial/dense6.hpp"

namespace linkwise::testing {
namespace {

struct Kind {
  const char* name;
  ElementKind kind;
  int nq, nv;
  double pitch;
};
void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }
constexpr Kind kinds[] = {
    {"fixed", ElementKind::fixed, 0, 0, 0},         {"revolute", ElementKind::revolute, 1, 1, 0},
    {"prismatic", ElementKind::prismatic, 1, 1, 0}, {"helical", ElementKind::helical, 1, 1, 0.37},
    {"spherical", ElementKind::spherical, 4, 3, 0}, {"planar", ElementKind::planar, 3, 3, 0},
    {"floating", ElementKind::floating, 7, 6, 0},
};

constexpr int first_q = 2, first_v = 1;  // elements address the whole machine's arrays

Element make_element(const Kind& kind, Draws& draws) {
  Element e;
  e.kind = kind.kind;
  e.q = first_q;
  e.v = first_v;
  e.nq = kind.nq;
  e.nv = kind.nv;
  e.pitch = kind.pitch;
  e.placement = {random_rotation(draws), random_vector3(draws)};
  return e;
}

std::vector<double> random_position(const Kind& kind, Draws& draws) {
  std::vector<double> q(first_q + kind.nq);
  for (double& x : q) x = draws.normal();
  return q;
}

/// Sixth-order central difference of f at 0.
template <class F>
double derivative(F&& f) {
  constexpr double h = 0.002;
  return (45 * (f(h) - f(-h)) - 9 * (f(2 * h) - f(-2 * h)) + (f(3 * h) - f(-3 * h))) / (60 * h);
}

class EveryKind : public ::testing::TestWithParam<Kind> {
 protected:
  Draws draws{42};
};

// The pose moved along dq/dt gives the relative velocity that the columns give: R' = -w~ R, and
// the origin moves with R^T v.
TEST_P(EveryKind, PoseRateAndColumnsAgree) {
  const Kind kind = GetParam();
  for (int sample = 0; sample < 10; ++sample) {
    const Element e = make_element(kind, draws);
    const std::vector<double> q = random_position(kind, draws);
    std::vector<double> u(first_v + kind.nv), rate(q.size(), 0.0);
    for (double& x : u) x = draws.normal();
    element_position_rate(e, q.data(), u.data(), rate.data());
    for (int i = 0; i < first_q; ++i) EXPECT_EQ(rate[i], 0) << "touches what is not its own";

    const auto pose_at = [&](double t) {
      std::vector<double> moved = q;
      for (size_t i = 0; i < q.size(); ++i) moved[i] += t * rate[i];
      return element_pose(e, moved.data());
    };
    Motion<double> relative{};
    for (int k = 0; k < kind.nv; ++k) {
      const Motion<double> column = element_column<double>(e, k);
      relative += u[first_v + k] * column;
    }
    const Transform<double> X = pose_at(0);
    const Mat3<double> turned = tilde(relative.ang) * X.R;
    for (int i = 0; i < 9; ++i)
      EXPECT_NEAR(derivative([&](double t) { return pose_at(t).R.m[i]; }), -turned.m[i], 1e-11);
    const Vec3<double> moved = transpose_times(X.R, relative.lin);
    EXPECT_NEAR(derivative([&](double t) { return pose_at(t).r.x; }), moved.x, 1e-11);
    EXPECT_NEAR(derivative([&](double t) { return pose_at(t).r.y; }), moved.y, 1e-11);
    EXPECT_NEAR(derivative([&](double t) { return pose_at(t).r.z; }), moved.z, 1e-11);
  }
}

TEST_P(EveryKind, ColumnsAreIndependentAndNoMore) {
  const Kind kind = GetParam();
  const Element e = make_element(kind, draws);
  // Distinct unit vectors, but for the screw's advance.
  for (int k = 0; k < kind.nv; ++k)
    for (int l = 0; l < kind.nv; ++l) {
      const auto a = to_array(element_column<double>(e, k));
      const auto b = to_array(element_column<double>(e, l));
      double product = 0;
      for (int i = 0; i < 6; ++i) product += a[i] * b[i];
      EXPECT_EQ(product, k == l ? 1 + kind.pitch * kind.pitch : 0);
    }
}

TEST_P(EveryKind, ZeroPositionIsThePlacement) {
  const Kind kind = GetParam();
  const Element e = make_element(kind, draws);
  std::vector<double> q(first_q + kind.nq, 0.0);
  if (kind.nq > kind.nv) q.back() = 1;
  const Transform<double> X = element_pose(e, q.data());
  for (int i = 0; i < 9; ++i) EXPECT_DOUBLE_EQ(X.R.m[i], e.placement.R.m[i]);
  EXPECT_DOUBLE_EQ(X.r.x, e.placement.r.x);
  EXPECT_DOUBLE_EQ(X.r.y, e.placement.r.y);
  EXPECT_DOUBLE_EQ(X.r.z, e.placement.r.z);
}

// The rotation does not depend on a quaternion's length, and moving along dq/dt does not change it.
TEST_P(EveryKind, QuaternionLengthIsFree) {
  const Kind kind = GetParam();
  if (kind.nq == kind.nv) return;
  const Element e = make_element(kind, draws);
  std::vector<double> q = random_position(kind, draws), rate(q.size());
  const std::vector<double> u{0, 0.3, -2, 1, 0.7, -0.4, 0.9};
  const Transform<double> X = element_pose(e, q.data());
  element_position_rate(e, q.data(), u.data(), rate.data());
  double change = 0;
  for (size_t i = q.size() - 4; i < q.size(); ++i) {
    change += q[i] * rate[i];
    q[i] *= 3;
  }
  EXPECT_NEAR(change, 0, 1e-15);
  const Transform<double> same = element_pose(e, q.data());
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(same.R.m[i], X.R.m[i], 1e-15);
}

template <int W>
void expect_lanes(const Kind& kind, Draws& draws) {
  using S = Lanes<W>;
  const Element e = make_element(kind, draws);
  std::vector<S> group(first_q + kind.nq);
  std::vector<double> one[W];
  for (int l = 0; l < W; ++l) {
    one[l] = random_position(kind, draws);
    for (size_t i = 0; i < group.size(); ++i) set_lane(group[i], l, one[l][i]);
  }
  const Transform<S> together = element_pose(e, group.data());
  for (int l = 0; l < W; ++l) {
    const Transform<double> alone = element_pose(e, one[l].data());
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(lane(together.R.m[i], l), alone.R.m[i], 1e-14);
    EXPECT_NEAR(lane(together.r.x, l), alone.r.x, 1e-14);
    EXPECT_NEAR(lane(together.r.y, l), alone.r.y, 1e-14);
    EXPECT_NEAR(lane(together.r.z, l), alone.r.z, 1e-14);
  }
}

TEST_P(EveryKind, LanesEqualScalars) {
  expect_lanes<2>(GetParam(), draws);
  expect_lanes<4>(GetParam(), draws);
  expect_lanes<8>(GetParam(), draws);
}

INSTANTIATE_TEST_SUITE_P(Elements, EveryKind, ::testing::ValuesIn(kinds),
                         [](const auto& test) { return std::string(test.param.name); });

// The one-axis joints' shortcuts against the columns that the general sweep uses.
template <class Joint>
void expect_shortcuts(const Kind& kind, Draws& draws) {
  const Element e = make_element(kind, draws);
  const Motion<double> P = element_column<double>(e, 0);
  const double u = draws.normal();
  const Motion<double> v{random_vector3(draws), random_vector3(draws)};
  const Force<double> f{random_vector3(draws), random_vector3(draws)};
  ArticulatedInertia<double> Y;
  add_inertia(Y, random_inertia(draws));
  Motion<double> moved = v;
  Joint::add_rate(moved, e.pitch, u);
  const Motion<double> Pu = u * P;
  const auto want_moved = to_array(v), got_moved = to_array(moved), step = to_array(Pu);
  const auto bias = to_array(Joint::bias(v, e.pitch, u)), want_bias = to_array(cross(v, Pu));
  const auto column = to_array(Joint::column(Y, e.pitch)), want_column = to_array(Y * P);
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(got_moved[i], want_moved[i] + step[i], 1e-15);
    EXPECT_NEAR(bias[i], want_bias[i], 1e-14);
    EXPECT_NEAR(column[i], want_column[i], 1e-14);
  }
  EXPECT_NEAR(Joint::project(f, e.pitch), dot(P, f), 1e-15);
}

TEST(AxisJoints, ShortcutsEqualTheirColumns) {
  Draws draws(5);
  for (int sample = 0; sample < 5; ++sample) {
    expect_shortcuts<RevoluteJoint>(kinds[1], draws);
    expect_shortcuts<PrismaticJoint>(kinds[2], draws);
    expect_shortcuts<HelicalJoint>(kinds[3], draws);
  }
}

}  // namespace
}  // namespace linkwise::testing
