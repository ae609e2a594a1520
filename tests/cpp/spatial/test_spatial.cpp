#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/simd/lanes.hpp"
#include "spatial/dense6.hpp"

namespace linkwise::testing {
namespace {

template <class S>
struct Operands {
  Transform<S> X, Z;
  Motion<S> v, m;
  Force<S> f, g;
  Inertia<S> M;
  ArticulatedInertia<S> Y;
};

Operands<double> random_operands(Draws& draws) {
  const auto motion = [&] { return Motion<double>{random_vector3(draws), random_vector3(draws)}; };
  const auto force = [&] { return Force<double>{random_vector3(draws), random_vector3(draws)}; };
  Operands<double> o{{random_rotation(draws), random_vector3(draws)},
                     {random_rotation(draws), random_vector3(draws)},
                     motion(),
                     motion(),
                     force(),
                     force(),
                     random_inertia(draws),
                     {}};
  add_inertia(o.Y, random_inertia(draws));
  for (double& x : o.Y.B.m) x += draws.normal();
  return o;
}

template <class S>
void append(std::vector<S>& out, const Vec3<S>& v) {
  out.insert(out.end(), {v.x, v.y, v.z});
}
template <class S>
std::vector<S> flat(const Motion<S>& v) {
  const auto a = to_array(v);
  return {a.begin(), a.end()};
}
template <class S>
std::vector<S> flat(const Force<S>& v) {
  const auto a = to_array(v);
  return {a.begin(), a.end()};
}
template <class S>
std::vector<S> flat(const Transform<S>& X) {
  std::vector<S> out(X.R.m, X.R.m + 9);
  append(out, X.r);
  return out;
}
template <class S>
std::vector<S> flat(const ArticulatedInertia<S>& Y) {
  std::vector<S> out(Y.A.m, Y.A.m + 6);
  out.insert(out.end(), Y.B.m, Y.B.m + 9);
  out.insert(out.end(), Y.C.m, Y.C.m + 6);
  return out;
}

/// What the library computes, operation by operation.
template <class S>
std::vector<std::vector<S>> all_operations(const Operands<S>& o) {
  ArticulatedInertia<S> with_body = o.Y, outer = o.Y, sum = o.Y;
  add_inertia(with_body, o.M);
  subtract_outer(outer, o.f, o.f);
  sum += outer;
  return {flat(o.X * o.v),
          flat(transpose_times(o.X, o.f)),
          flat(inverse_times(o.X, o.v)),
          flat(inverse_transpose_times(o.X, o.f)),
          flat(cross(o.v, o.m)),
          flat(cross_dual(o.v, o.f)),
          flat(o.M * o.v),
          flat(o.Y * o.v),
          flat(with_body),
          flat(outer),
          flat(sum),
          flat(transform_to_parent(o.X, o.Y)),
          flat(o.X * o.Z),
          {dot(o.v, o.f)}};
}
const std::vector<std::string> operation_names{
    "X v", "X^T f", "X^-1 v",    "X^-T f",      "v x m",   "v x* f", "M v",
    "Y v", "Y + M", "Y - f f^T", "2 Y - f f^T", "X^T Y X", "X Z",    "v . f"};

void expect_near(const std::vector<double>& got, const std::vector<double>& want,
                 const std::string& what, double tolerance = 1e-13) {
  ASSERT_EQ(got.size(), want.size()) << what;
  for (size_t i = 0; i < got.size(); ++i)
    EXPECT_NEAR(got[i], want[i], tolerance * (1 + std::abs(want[i]))) << what << " [" << i << "]";
}

std::vector<double> flat(const Array6& a) { return {a.begin(), a.end()}; }

/// Packed parts of a symmetric 6x6 matrix, as flat(ArticulatedInertia) lists them.
std::vector<double> packed_parts(const Dense6& d) {
  std::vector<double> out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) out.push_back(d[i][j]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.push_back(d[i][3 + j]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) out.push_back(d[3 + i][3 + j]);
  return out;
}

TEST(Spatial, EveryOperationEqualsDenseArithmetic) {
  Draws draws(7);
  for (int sample = 0; sample < 20; ++sample) {
    const Operands<double> o = random_operands(draws);
    const Array6 v = to_array(o.v), m = to_array(o.m), f = to_array(o.f);
    const Dense6 X = dense(o.X), M = dense(o.M), Y = dense(o.Y), cross_v = dense_cross(o.v);
    Dense6 with_body = Y, outer = Y, sum = Y, minus_cross_v_transposed = transposed(cross_v);
    double power = 0;
    for (int i = 0; i < 6; ++i) {
      power += v[i] * f[i];
      for (int j = 0; j < 6; ++j) {
        with_body[i][j] += M[i][j];
        outer[i][j] -= f[i] * f[j];
        sum[i][j] += outer[i][j];
        minus_cross_v_transposed[i][j] *= -1;
      }
    }
    const auto got = all_operations(o);
    const std::vector<std::vector<double>> want{
        flat(multiply(X, v)),
        flat(multiply(transposed(X), f)),
        flat(multiply(inverted(X), v)),
        flat(multiply(transposed(inverted(X)), f)),
        flat(multiply(cross_v, m)),
        flat(multiply(minus_cross_v_transposed, f)),
        flat(multiply(M, v)),
        flat(multiply(Y, v)),
        packed_parts(with_body),
        packed_parts(outer),
        packed_parts(sum),
        packed_parts(multiply(transposed(X), multiply(Y, X)))};
    for (size_t k = 0; k < want.size(); ++k) expect_near(got[k], want[k], operation_names[k]);
    const Dense6 composed = multiply(X, dense(o.Z)), direct = dense(o.X * o.Z);
    for (int i = 0; i < 6; ++i)
      expect_near(flat(direct[i]), flat(composed[i]), "X Z row " + std::to_string(i));
    EXPECT_NEAR(got.back()[0], power, 1e-14 * (1 + std::abs(power)));
  }
}

TEST(Spatial, AScalarScalesEveryComponent) {
  Draws draws(8);
  const Operands<double> o = random_operands(draws);
  const Array6 v = to_array(o.v), f = to_array(o.f);
  const Array6 got_v = to_array(-2.5 * o.v), got_f = to_array(-2.5 * o.f);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(got_v[i], -2.5 * v[i]);
    EXPECT_EQ(got_f[i], -2.5 * f[i]);
  }
}

TEST(Spatial, TransformsComeBackAndKeepPower) {
  Draws draws(8);
  for (int sample = 0; sample < 20; ++sample) {
    const auto [X, Z, v, m, f, g, M, Y] = random_operands(draws);
    expect_near(flat(inverse_times(X, X * v)), flat(v), "X^-1 X v");
    expect_near(flat(X * inverse_times(X, v)), flat(v), "X X^-1 v");
    expect_near(flat(inverse_transpose_times(X, transpose_times(X, f))), flat(f), "X^-T X^T f");
    expect_near(flat(transpose_times(X, inverse_transpose_times(X, f))), flat(f), "X^T X^-T f");
    EXPECT_NEAR(dot(X * v, f), dot(v, transpose_times(X, f)), 1e-13);
    EXPECT_NEAR(dot(X * v, inverse_transpose_times(X, f)), dot(v, f), 1e-13);
    EXPECT_NEAR(dot(cross(v, m), f), -dot(m, cross_dual(v, f)), 1e-13);
    // Momentum is a force: its power with v is twice the kinetic energy wherever it is measured.
    const Motion<double> at_child = X * v;
    EXPECT_NEAR(dot(v, transform_to_parent(X, Y) * v), dot(at_child, Y * at_child), 1e-11);
  }
}

TEST(Spatial, ComplianceIsTheInverseOfTheInertia) {
  Draws draws(9);
  for (double scale : {1e-6, 1.0, 1e6})
    for (int sample = 0; sample < 10; ++sample) {
      Inertia<double> M = random_inertia(draws);
      M.m *= scale;
      M.mc = scale * M.mc;
      for (double& x : M.I.m) x *= scale;
      const Compliance<double> L = invert_inertia(M);
      const Matrix6<double> matrix = to_matrix(L);
      const Dense6 want = inverted(dense(M));
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j)
          EXPECT_NEAR(matrix[6 * i + j], want[i][j], 1e-12 * std::abs(want[i][i] + want[j][j]));
      const Motion<double> v{random_vector3(draws), random_vector3(draws)};
      expect_near(flat(L * (M * v)), flat(v), "M^-1 M v", 1e-12);
    }
}

template <int W>
void expect_lanes_equal_scalars() {
  using S = Lanes<W>;
  Draws draws(10 + W);
  Operands<double> one[W];
  Operands<S> group;
  for (int l = 0; l < W; ++l) {
    one[l] = random_operands(draws);
    // Every operand is a plain aggregate of scalars, so both are arrays of the same length.
    static_assert(sizeof(Operands<S>) == W * sizeof(Operands<double>));
    for (size_t i = 0; i < sizeof(Operands<double>) / sizeof(double); ++i)
      set_lane(reinterpret_cast<S*>(&group)[i], l, reinterpret_cast<const double*>(&one[l])[i]);
  }
  const auto together = all_operations(group);
  for (int l = 0; l < W; ++l) {
    const auto alone = all_operations(one[l]);
    for (size_t k = 0; k < alone.size(); ++k) {
      std::vector<double> of_lane;
      for (const S& x : together[k]) of_lane.push_back(lane(x, l));
      expect_near(of_lane, alone[k], operation_names[k] + " in a lane", 1e-14);
    }
  }
}

TEST(Spatial, LanesEqualScalars) {
  expect_lanes_equal_scalars<1>();
  expect_lanes_equal_scalars<2>();
  expect_lanes_equal_scalars<4>();
  expect_lanes_equal_scalars<8>();
}

}  // namespace
}  // namespace linkwise::testing
