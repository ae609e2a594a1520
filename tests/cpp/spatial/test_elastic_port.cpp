// A port's columns and their rates against differences of its pose.
#include <cmath>

#include <gtest/gtest.h>

#include "linkwise/spatial/elastic_port.hpp"

namespace linkwise::testing {
namespace {

constexpr int n = 4;

ElasticShape shape() {
  ElasticShape out;
  out.n = n;
  out.rest = {1.3, 0.2, -0.4};
  out.Phi = {{1, 0, 0.3}, {0, 0.7, 0.1}, {0.2, 0, 0.5}, {0, 0.1, 0}};
  out.Psi = {{0, 0.4, 0}, {0.3, 0, 0.9}, {0, -0.8, 0.1}, {1.1, 0, 0.2}};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < n * (n + 1) / 2; ++k) out.G[i].push_back(std::sin(3.0 * i + k));
  return out;
}

const double eta[n] = {0.3, -0.5, 0.7, 0.4}, xi[n] = {0.9, 0.2, -0.6, 1.1};

ElasticPort<double> port_after(double t) {
  double moved[n];
  for (int k = 0; k < n; ++k) moved[k] = eta[k] + t * xi[k];
  ElasticPort<double> out;
  calc_elastic_port(shape(), moved, out);
  return out;
}

Motion<double> relative(const ElasticPort<double>& port) {
  Motion<double> out;
  for (int k = 0; k < n; ++k) out += xi[k] * port.P[k];
  return out;
}

TEST(ElasticPort, TurnsByARotation) {
  const Mat3<double> R = port_after(0).X.R, product = R * transpose(R);
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(product.m[i], i % 4 == 0, 1e-15);
}

/// Columns are the velocity of the frame in its own axes: of r and of R, by central differences.
TEST(ElasticPort, ColumnsAreTheVelocityOfThePose) {
  constexpr double h = 1e-5;
  const ElasticPort<double> now = port_after(0), after = port_after(h), before = port_after(-h);
  const Vec3<double> speed = now.X.R * ((0.5 / h) * (after.X.r - before.X.r));
  // R' = -w~ R.
  Mat3<double> rate;
  for (int i = 0; i < 9; ++i) rate.m[i] = (after.X.R.m[i] - before.X.R.m[i]) / (2 * h);
  const Mat3<double> W = rate * transpose(now.X.R);
  const Motion<double> found = relative(now);
  EXPECT_NEAR(found.lin.x, speed.x, 1e-9);
  EXPECT_NEAR(found.lin.y, speed.y, 1e-9);
  EXPECT_NEAR(found.lin.z, speed.z, 1e-9);
  EXPECT_NEAR(found.ang.x, W.m[5], 1e-9);
  EXPECT_NEAR(found.ang.y, W.m[6], 1e-9);
  EXPECT_NEAR(found.ang.z, W.m[1], 1e-9);
}

TEST(ElasticPort, TheirRateIsThatOfTheColumns) {
  constexpr double h = 1e-5;
  const ElasticPort<double> now = port_after(0);
  const Motion<double> after = relative(port_after(h)), before = relative(port_after(-h));
  const Motion<double> found = elastic_column_rate(shape(), now, xi, relative(now));
  EXPECT_NEAR(found.lin.x, (after.lin.x - before.lin.x) / (2 * h), 1e-9);
  EXPECT_NEAR(found.lin.y, (after.lin.y - before.lin.y) / (2 * h), 1e-9);
  EXPECT_NEAR(found.lin.z, (after.lin.z - before.lin.z) / (2 * h), 1e-9);
  EXPECT_NEAR(found.ang.x, (after.ang.x - before.ang.x) / (2 * h), 1e-9);
  EXPECT_NEAR(found.ang.y, (after.ang.y - before.ang.y) / (2 * h), 1e-9);
  EXPECT_NEAR(found.ang.z, (after.ang.z - before.ang.z) / (2 * h), 1e-9);
}

TEST(ElasticPort, SeriesAreTheClosedForms) {
  for (const double s : {0.1, 1.0, 2.5}) {
    const TurnSeries<double> of(s * s);
    EXPECT_NEAR(of.sine, std::sin(s) / s, 1e-15);
    EXPECT_NEAR(of.versine, 2 * std::pow(std::sin(s / 2) / s, 2), 1e-15);
    if (s >= 1) EXPECT_NEAR(of.rest, (s - std::sin(s)) / (s * s * s), 1e-15);
  }
}

}  // namespace
}  // namespace linkwise::testing
