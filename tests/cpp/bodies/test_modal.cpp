// A modal body against a slow sum over its points, which knows nothing of mass integrals.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/bodies/body_kinds.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise::testing {
namespace {

constexpr int n = 7;

struct Cloud {
  struct Point {
    double m;
    Vec3<double> r;
    Vec3<double> phi[n];
  };
  std::vector<Point> points;
  Mat3<double> axes;
  std::mt19937 random{7};
  std::normal_distribution<double> normal;

  Vec3<double> vector() { return {normal(random), normal(random), normal(random)}; }

  Cloud() {
    for (int k = 0; k < 25; ++k) {
      Point point{0.1 + std::abs(normal(random)), vector(), {}};
      for (Vec3<double>& phi : point.phi) phi = 0.5 * vector();
      points.push_back(point);
    }
    const double c = std::cos(0.7), s = std::sin(0.7);
    axes = Mat3<double>{{c, -s, 0, s, c, 0, 0, 0, 1}} * Mat3<double>{{1, 0, 0, 0, s, -c, 0, c, s}};
  }

  std::vector<double> parameters() const {
    ModalProperties head{};
    head.n = n;
    std::copy(axes.m, axes.m + 9, head.axes);
    std::vector<double> C(3 * n), N_i0(9 * n), N_ij(9 * n * (n + 1) / 2);
    for (const Point& point : points) {
      const auto [m, r, phi] = point;
      const double at[] = {r.x, r.y, r.z};
      head.mass += m;
      for (int a = 0; a < 3; ++a) {
        head.mc[a] += m * at[a];
        for (int b = 0; b <= a; ++b) head.N0[packed(a, b)] += m * at[a] * at[b];
      }
      for (int i = 0; i < n; ++i) {
        const double f[] = {phi[i].x, phi[i].y, phi[i].z};
        for (int a = 0; a < 3; ++a) {
          C[3 * i + a] += m * f[a];
          for (int b = 0; b < 3; ++b) N_i0[9 * i + 3 * a + b] += m * at[a] * f[b];
        }
        for (int j = 0; j <= i; ++j) {
          const double g[] = {phi[j].x, phi[j].y, phi[j].z};
          for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) N_ij[9 * packed(i, j) + 3 * a + b] += m * f[a] * g[b];
        }
      }
    }
    const auto* first = reinterpret_cast<const double*>(&head);
    std::vector<double> out(first, first + sizeof head / sizeof(double));
    const auto append = [&](const std::vector<double>& more) {
      out.insert(out.end(), more.begin(), more.end());
    };
    append(C);
    append(N_i0);
    append(std::vector<double>(6 * n, 0.0));
    append(std::vector<double>(n, 3.0));
    append(std::vector<double>(n, 0.2));
    append(N_ij);
    return out;
  }
};

/// M (6 + n)^2 and the bias of a body, whatever it is made of.
struct Dense {
  static constexpr int size = 6 + n;
  double M[size][size] = {}, p[size] = {};
};

Dense blocks(const ModalBody& body, const Motion<double>& v, const double* q, const double* rates) {
  OwnEquationsHere<double> of;
  calc_equations(body, v, OwnState<double>{q, rates, nullptr}, of);
  Dense out;
  for (int c = 0; c < 6; ++c) {
    double unit[6] = {};
    unit[c] = 1;
    const Vector6<double> column = to_array(of.M * to_motion(unit));
    for (int r = 0; r < 6; ++r) out.M[r][c] = column[r];
  }
  const Vector6<double> p = to_array(of.p);
  for (int r = 0; r < 6; ++r) out.p[r] = p[r];
  for (int k = 0; k < n; ++k) {
    const Vector6<double> column = to_array(of.M_e[k]);
    for (int r = 0; r < 6; ++r) out.M[r][6 + k] = out.M[6 + k][r] = column[r];
    for (int l = 0; l < n; ++l) out.M[6 + k][6 + l] = of.m_e[k >= l ? packed(k, l) : packed(l, k)];
    out.p[6 + k] = of.p_e[k];
  }
  return out;
}

/// The same, point by point: J = [1, -r~, phi], M = sum m J^T J, bias = sum m J^T (w x v + w x
/// rate).
Dense sums(const Cloud& cloud, const Motion<double>& v, const double* q, const double* rates) {
  Dense out;
  for (const Cloud::Point& point : cloud.points) {
    Vec3<double> r = point.r, rate{};
    for (int k = 0; k < n; ++k) {
      r += q[k] * point.phi[k];
      rate += rates[k] * point.phi[k];
    }
    r = cloud.axes * r;
    rate = cloud.axes * rate;
    Vec3<double> J[Dense::size];
    const Vec3<double> unit[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int a = 0; a < 3; ++a) {
      J[a] = unit[a];
      J[3 + a] = cross(unit[a], r);
    }
    for (int k = 0; k < n; ++k) J[6 + k] = cloud.axes * point.phi[k];
    const Vec3<double> speed = v.lin + cross(v.ang, r) + rate;
    const Vec3<double> bias = cross(v.ang, speed) + cross(v.ang, rate);
    for (int a = 0; a < Dense::size; ++a) {
      out.p[a] += point.m * dot(J[a], bias);
      for (int b = 0; b < Dense::size; ++b) out.M[a][b] += point.m * dot(J[a], J[b]);
    }
  }
  return out;
}

class Modal : public ::testing::Test {
 protected:
  Modal() : body(ModalBody::make({}, cloud.parameters())) {
    v = {cloud.vector(), cloud.vector()};
    for (int k = 0; k < n; ++k) {
      q[k] = cloud.normal(cloud.random);
      rates[k] = cloud.normal(cloud.random);
    }
  }
  Cloud cloud;
  ModalBody body;
  Motion<double> v;
  double q[n], rates[n];
};

TEST_F(Modal, IsTheSumOverItsPoints) {
  const Dense is = blocks(body, v, q, rates), slow = sums(cloud, v, q, rates);
  double largest = 0, heaviest = 0;
  for (int a = 0; a < Dense::size; ++a) {
    largest = std::max(largest, std::abs(slow.p[a]));
    for (int b = 0; b < Dense::size; ++b) heaviest = std::max(heaviest, std::abs(slow.M[a][b]));
  }
  for (int a = 0; a < Dense::size; ++a) {
    EXPECT_NEAR(is.p[a], slow.p[a], 1e-12 * largest) << a;
    for (int b = 0; b < Dense::size; ++b)
      EXPECT_NEAR(is.M[a][b], slow.M[a][b], 1e-12 * heaviest) << a << " " << b;
  }
}

/// V^T bias = V^T dM/dt V / 2: bias forces do no work but that on the inertia that changes. M is
/// of second order in the coordinates, so its central difference is its slope.
TEST_F(Modal, KeepsEnergy) {
  double ahead[n], behind[n], V[Dense::size];
  const Vector6<double> of_frame = to_array(v);
  for (int a = 0; a < 6; ++a) V[a] = of_frame[a];
  for (int k = 0; k < n; ++k) {
    V[6 + k] = rates[k];
    ahead[k] = q[k] + 0.5 * rates[k];
    behind[k] = q[k] - 0.5 * rates[k];
  }
  const Dense here = blocks(body, v, q, rates), next = blocks(body, v, ahead, rates),
              last = blocks(body, v, behind, rates);
  double power = 0, change = 0, scale = 0;
  for (int a = 0; a < Dense::size; ++a) {
    power += V[a] * here.p[a];
    for (int b = 0; b < Dense::size; ++b) {
      change += 0.5 * V[a] * (next.M[a][b] - last.M[a][b]) * V[b];
      scale += std::abs(V[a] * here.M[a][b] * V[b]);
    }
  }
  EXPECT_NEAR(power, change, 1e-13 * scale);
  EXPECT_GT(std::abs(power), 1e-3 * scale);
}

TEST_F(Modal, AtRestIsARigidBody) {
  const double none[n] = {};
  const Dense is = blocks(body, v, none, none);
  const Vector6<double> bias = to_array(momentum_bias(body, v));
  for (int a = 0; a < 6; ++a) {
    double unit[6] = {};
    unit[a] = 1;
    const Vector6<double> column = to_array(inertia_times(body, to_motion(unit)));
    for (int b = 0; b < 6; ++b) EXPECT_NEAR(is.M[b][a], column[b], 1e-12 * std::abs(is.M[5][5]));
    EXPECT_NEAR(is.p[a], bias[a], 1e-12 * 100);
  }
}

/// Given in another frame it moves likewise.
TEST_F(Modal, MovesToAnotherFrame) {
  const Transform<double> X{cloud.axes, {0.3, -0.2, 0.5}};  // new frame -> body's
  const ModalBody other = moved(body, X);
  OwnEquationsHere<double> here, there;
  calc_equations(other, v, OwnState<double>{q, rates, nullptr}, there);
  calc_equations(body, X * v, OwnState<double>{q, rates, nullptr}, here);
  for (int k = 0; k < n; ++k) {
    EXPECT_NEAR(there.p_e[k], here.p_e[k], 1e-11 * (1 + std::abs(here.p_e[k])));
    const Vector6<double> a = to_array(there.M_e[k]), b = to_array(transpose_times(X, here.M_e[k]));
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(a[i], b[i], 1e-11);
  }
}

TEST_F(Modal, SaysWhatIsWrong) {
  std::vector<double> of = cloud.parameters();
  EXPECT_EQ(ModalBody::fault(of), "");
  of[0] = 41;
  EXPECT_EQ(ModalBody::fault(of),
            "the modal body has 41 coordinates; give 1 to 40, fewer by the argument modes");
  of[0] = n - 1;
  EXPECT_EQ(ModalBody::fault(of),
            "a modal body of 6 coordinates takes 333 parameters, not 416; give all of them");
  of = cloud.parameters();
  of[2] = 0;
  EXPECT_EQ(ModalBody::fault(of), "the modal body's mass is not positive; give one above 0");
  of = cloud.parameters();
  std::fill_n(of.end() - 9, 9, 0.0);
  EXPECT_EQ(ModalBody::fault(of), "shape 7 of the modal body moves no mass; give shapes that do");
  EXPECT_NE(ModalBody::fault({}), "");
}

}  // namespace
}  // namespace linkwise::testing
