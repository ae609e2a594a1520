#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/integrate/integrator.hpp"

namespace linkwise::test {

/// q'' = -q + 3 cos(2 t), q(0) = q'(0) = 0, whose solution is cos t - cos 2t.
struct ForcedOscillator : OdeSystem {
  int size() const override { return 2; }
  int position_size() const override { return 1; }
  Outcome evaluate(double t, const double* y, double* ydot) override {
    ydot[0] = y[1];
    ydot[1] = -y[0] + 3.0 * std::cos(2.0 * t);
    return Outcome::converged;
  }
  void position_rates(const double*, const double* v, double* qdot) override { qdot[0] = v[0]; }

  static std::array<double, 2> initial() { return {0.0, 0.0}; }
  static std::array<double, 2> solution(double t) {
    return {std::cos(t) - std::cos(2.0 * t), -std::sin(t) + 2.0 * std::sin(2.0 * t)};
  }
  static double error(double t, const std::vector<double>& y) {
    const auto exact = solution(t);
    return std::max(std::abs(y[0] - exact[0]), std::abs(y[1] - exact[1]));
  }
};

/// Velocities alone, v' = f(t, v), with f given by the test.
struct FirstOrder : OdeSystem {
  using Rate = std::function<bool(double t, const double* v, double* rate)>;
  FirstOrder(int n, Rate f) : n_(n), rate(std::move(f)) {}
  int size() const override { return n_; }
  int position_size() const override { return 0; }
  Outcome evaluate(double t, const double* y, double* ydot) override {
    return rate(t, y, ydot) ? Outcome::converged : Outcome::not_positive_definite;
  }
  void position_rates(const double*, const double*, double*) override {}
  void accepted(double t, const double*) override { accepted_times.push_back(t); }

  int n_;
  Rate rate;
  std::vector<double> accepted_times;
};

/// A unit quaternion (x, y, z, w) turning at the constant angular velocity (0, 0, rate) in the
/// body.
struct SpinningBody : OdeSystem {
  int size() const override { return 7; }
  int position_size() const override { return 4; }
  Outcome evaluate(double, const double* y, double* ydot) override {
    position_rates(y, y + 4, ydot);
    ydot[4] = ydot[5] = ydot[6] = 0.0;
    return Outcome::converged;
  }
  void position_rates(const double* q, const double* w, double* qdot) override {
    const double x = q[0], y = q[1], z = q[2], s = q[3];
    qdot[0] = 0.5 * (s * w[0] + y * w[2] - z * w[1]);
    qdot[1] = 0.5 * (s * w[1] + z * w[0] - x * w[2]);
    qdot[2] = 0.5 * (s * w[2] + x * w[1] - y * w[0]);
    qdot[3] = -0.5 * (x * w[0] + y * w[1] + z * w[2]);
  }
  bool constrained() const override { return true; }
  Outcome project(double, double* y) override {
    const double length = std::hypot(std::hypot(y[0], y[1]), std::hypot(y[2], y[3]));
    for (int i = 0; i < 4; ++i) y[i] /= length;
    return Outcome::converged;
  }
  static std::vector<double> initial(double rate) { return {0, 0, 0, 1, 0, 0, rate}; }
  static double norm(const std::vector<double>& y) {
    return std::hypot(std::hypot(y[0], y[1]), std::hypot(y[2], y[3]));
  }
};

/// A pendulum of length 1 in Cartesian coordinates, let go horizontally: y = (x, z, x', z'), with
/// the accelerations that keep r.r = 1, which the integration leaves unless y is projected.
struct CartesianPendulum : OdeSystem {
  explicit CartesianPendulum(bool projects) : projects_(projects) {}
  int size() const override { return 4; }
  int position_size() const override { return 2; }
  Outcome evaluate(double, const double* y, double* ydot) override {
    const double x = y[0], z = y[1], vx = y[2], vz = y[3];
    const double pull = (vx * vx + vz * vz - gravity * z) / (x * x + z * z);
    ydot[0] = vx;
    ydot[1] = vz;
    ydot[2] = -pull * x;
    ydot[3] = -pull * z - gravity;
    return Outcome::converged;
  }
  void position_rates(const double*, const double* v, double* qdot) override {
    qdot[0] = v[0];
    qdot[1] = v[1];
  }
  bool constrained() const override { return projects_; }
  Outcome project(double, double* y) override {
    if (!projects_) return Outcome::converged;
    const double length = std::hypot(y[0], y[1]);
    y[0] /= length;
    y[1] /= length;
    const double stretch = y[0] * y[2] + y[1] * y[3];
    y[2] -= stretch * y[0];
    y[3] -= stretch * y[1];
    return Outcome::converged;
  }

  static constexpr double gravity = 9.81;
  static std::vector<double> initial() { return {1, 0, 0, 0}; }
  /// How far y is off its constraints.
  static double drift(const std::vector<double>& y) {
    return std::max(std::abs(std::hypot(y[0], y[1]) - 1), std::abs(y[0] * y[2] + y[1] * y[3]));
  }
  static double energy(const std::vector<double>& y) {
    return 0.5 * (y[2] * y[2] + y[3] * y[3]) + gravity * y[1];
  }
  /// At t = 10 s, from sin(angle / 2) = k sn(K - sqrt(gravity) t, k) with k^2 = 1/2.
  static double error_at_10(const std::vector<double>& y) {
    return std::hypot(y[0] - 0.275087462576117, y[1] + 0.961419205099125);
  }

 private:
  bool projects_;
};

/// Steps to t_end and returns y there; how the last step ended is in outcome.
inline std::vector<double> integrate_to(Integrator& integrator, double t_end, int size,
                                        Outcome* outcome = nullptr) {
  Outcome last = Outcome::converged;
  while (integrator.time() < t_end && last == Outcome::converged) last = integrator.step(t_end);
  if (outcome != nullptr) *outcome = last;
  std::vector<double> y(static_cast<std::size_t>(size));
  integrator.interpolate(std::min(t_end, integrator.time()), y);
  return y;
}

/// The least-squares slope of log(y) over log(x).
inline double log_slope(const std::vector<double>& x, const std::vector<double>& y) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double u = std::log(x[i]), v = std::log(y[i]);
    sx += u, sy += v, sxx += u * u, sxy += u * v;
  }
  const auto n = static_cast<double>(x.size());
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

/// The order in which the largest error of a ForcedOscillator falls with the step, at the fraction
/// s of every step up to t_end. make(system, step) is the integrator.
template <class Make>
double convergence_order(const std::vector<double>& steps, double t_end, double s, Make&& make) {
  std::vector<double> errors;
  for (const double step : steps) {
    ForcedOscillator system;
    const auto integrator = make(system, step);
    integrator->start(0.0, ForcedOscillator::initial());
    double error = 0.0;
    std::vector<double> y(2);
    while (integrator->time() < t_end - 0.5 * step) {
      const double before = integrator->time();
      EXPECT_EQ(integrator->step(t_end), Outcome::converged);
      const double t = before + s * (integrator->time() - before);
      integrator->interpolate(t, y);
      error = std::max(error, ForcedOscillator::error(t, y));
    }
    errors.push_back(error);
  }
  return log_slope(steps, errors);
}

}  // namespace linkwise::test
