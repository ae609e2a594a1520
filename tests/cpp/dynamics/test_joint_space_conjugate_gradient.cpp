#include <cmath>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/dynamics/quantities.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

DynamicsOptions to(double tolerance) {
  DynamicsOptions options;
  options.method = "joint_space_conjugate_gradient";
  options.solver_options.tolerance = tolerance;
  return options;
}

struct Scene {
  Draws draws{71};
  Model model{tree_spec({revolute, universal, prismatic, revolute, spherical, revolute, revolute},
                        {-1, 0, 1, 1, 3, 4, 5}, draws)};
  DynamicsCase c{model, 72};
};

// The A-norm of conjugate gradients on H is the kinetic-energy norm.
TEST(JointSpaceConjugateGradient, MeetsItsToleranceInTheKineticEnergyNorm) {
  Scene scene;
  DynamicsOptions recursion;
  recursion.method = "articulated_body";
  const Motion6 exact =
      evaluate(*make_dynamics(scene.model, recursion), scene.model, scene.c.input());
  const double* q = scene.c.state.q.data();
  int before = 0;
  for (double tolerance : {1e-2, 1e-4, 1e-8}) {
    const auto method = make_dynamics(scene.model, to(tolerance));
    std::vector<double> du(scene.model.nv());
    const DynamicsReport report = method->evaluate(0, scene.c.input(), du.data(), nullptr);
    ASSERT_TRUE(report.ok());
    EXPECT_GE(report.iterations, before);
    before = report.iterations;
    for (size_t i = 0; i < du.size(); ++i) du[i] -= exact.du[i];
    // ||H^-1 b||_H is that of the motion from rest under the same forces, of the order of exact.du.
    const double error = kinetic_energy(scene.model, q, du.data());
    const double size = kinetic_energy(scene.model, q, exact.du.data());
    EXPECT_LE(std::sqrt(error / size), 5 * tolerance);
  }
  EXPECT_GT(before, 3);
}

TEST(JointSpaceConjugateGradient, TakesAtMostAsManyIterationsAsDegreesOfFreedom) {
  Draws draws(73);
  const Model model(tree_spec(std::vector(6, revolute), chain_parents(6), draws));
  const DynamicsCase c(model, 74);
  std::vector<double> du(6);
  const DynamicsReport report =
      make_dynamics(model, to(1e-9))->evaluate(0, c.input(), du.data(), nullptr);
  EXPECT_TRUE(report.ok());
  EXPECT_LE(report.iterations, 6 + 2);  // rounding
}

TEST(JointSpaceConjugateGradient, SaysWhenTheLimitIsReached) {
  Scene scene;
  DynamicsOptions options = to(1e-12);
  options.solver_options.max_iterations = 2;
  std::vector<double> du(scene.model.nv());
  const DynamicsReport report =
      make_dynamics(scene.model, options)->evaluate(0, scene.c.input(), du.data(), nullptr);
  EXPECT_EQ(report.outcome, Outcome::reached_max_iterations);
  EXPECT_EQ(report.iterations, 2);
}

}  // namespace
}  // namespace linkwise::testing
