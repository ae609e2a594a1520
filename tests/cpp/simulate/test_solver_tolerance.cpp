// The bound on the constraint forces' error: whatever the error, the integrator's error test sees
// at most a tenth of what it accepts.

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "linear/dense_twin.hpp"
#include "linkwise/dynamics/composite_rigid_body.hpp"
#include "linkwise/simulate/solver_tolerance.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

struct Scene {
  Draws draws{51};
  Model model{tree_spec({revolute, universal, prismatic, revolute, spherical, revolute},
                        {-1, 0, 1, 1, 3, 4}, draws)};
  MachineState state = random_state(model, draws);
  int nv = model.nv();
  static constexpr double relative = 1e-6, absolute = 1e-7, rough = 1e-7;

  Scene() {
    for (double& value : state.v) value *= 0.3;
  }
  /// The tolerance after `steps` steps of length h, about to evaluate at the end of the next one.
  EnergyBound after(int steps, double h) {
    SolverTolerance tolerance(model, relative, absolute, rough);
    tolerance.start(1.0);
    for (int k = 1; k <= steps; ++k)
      tolerance.accepted(1.0 + k * h, state.q.data(), state.v.data());
    tolerance.set(1.0 + (steps + 1) * h);
    return *tolerance.bound();
  }
  /// In the integrator's norm, of the acceleration error a over a step.
  double weighted(const std::vector<double>& a, double h) const {
    double sum = 0;
    for (int i = 0; i < nv; ++i) {
      const double error = h * a[i] / (relative * std::abs(state.v[i]) + absolute);
      sum += error * error;
    }
    return std::sqrt(sum / (model.nq() + nv));
  }
};

TEST(SolverTolerance, LeavesATenthOfTheStepsErrorToTheForces) {
  Scene scene;
  const double h = 0.02;
  const EnergyBound bound = scene.after(12, h);
  ASSERT_GT(bound.absolute, 0);
  Dense H;
  H.size = scene.nv;
  H.a.resize(static_cast<size_t>(scene.nv) * scene.nv);
  CompositeRigidBody(scene.model).mass_matrix(scene.state.q.data(), H.a.data());
  const auto scaled = [&](std::vector<double> a) {  // to the energy norm of the bound
    const std::vector<double> Ha = multiply(H, a);
    double square = 0;
    for (int i = 0; i < scene.nv; ++i) square += a[i] * Ha[i];
    for (double& value : a) value *= bound.absolute / std::sqrt(square);
    return a;
  };
  double most = 0;
  for (int i = 0; i < scene.nv; ++i) {  // the worst errors: unit torques' accelerations
    std::vector<double> unit(scene.nv, 0.0);
    unit[i] = 1;
    most = std::max(most, scene.weighted(scaled(cholesky_solve(H, unit)), h));
  }
  for (int k = 0; k < 100; ++k)
    most = std::max(most, scene.weighted(scaled(random_values(scene.nv, scene.draws)), h));
  EXPECT_LE(most, 0.1);
  EXPECT_GE(most, 0.02);  // and is not wasteful
}

TEST(SolverTolerance, IsInverseToTheStep) {
  Scene scene;
  EXPECT_NEAR(scene.after(12, 0.02).absolute, 5 * scene.after(12, 0.1).absolute, 1e-18);
}

TEST(SolverTolerance, IsCarefulWhileTheStepsGrow) {
  Scene scene;
  EXPECT_NEAR(scene.after(3, 0.02).absolute, scene.after(12, 0.02).absolute / 100, 1e-18);
  const EnergyBound first = scene.after(0, 0.02);
  EXPECT_EQ(first.relative, 0.01 * Scene::rough);
  EXPECT_EQ(first.absolute, 0);
}

TEST(SolverTolerance, AFailedStepDoesNotLoosenIt) {
  Scene scene;
  SolverTolerance tolerance(scene.model, Scene::relative, Scene::absolute, Scene::rough);
  tolerance.start(0.0);
  for (int k = 1; k <= 12; ++k)
    tolerance.accepted(0.1 * k, scene.state.q.data(), scene.state.v.data());
  tolerance.set(1.3);
  const double before = tolerance.bound()->absolute;
  tolerance.set(1.2001);
  EXPECT_NEAR(tolerance.bound()->absolute, before, 1e-9 * before);
  tolerance.set(1.4);
  EXPECT_NEAR(tolerance.bound()->absolute, before / 2, 1e-9 * before);
  tolerance.start(0.0);
  EXPECT_EQ(tolerance.bound()->absolute, 0);
}

}  // namespace
}  // namespace linkwise::testing
