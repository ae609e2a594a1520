// What a rigid body answers at its ports, against dense matrices.

#include <gtest/gtest.h>

#include "linkwise/bodies/body_kinds.hpp"
#include "spatial/dense6.hpp"

namespace linkwise::testing {
namespace {

Transform<double> random_port(Draws& draws) {
  return {transpose(random_rotation(draws)), random_vector3(draws)};
}
Motion<double> random_motion(Draws& draws) {
  return {random_vector3(draws), random_vector3(draws)};
}

void expect_near(const Matrix6<double>& found, const Dense6& want, const char* what) {
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(found[6 * i + j], want[i][j], 1e-11 * std::abs(want[i][i] + want[j][j]))
          << what << " " << i << " " << j;
}

TEST(RigidBody, ComplianceBetweenPortsIsThatOfItsMatrix) {
  Draws draws(1);
  for (int sample = 0; sample < 10; ++sample) {
    const RigidBody<double> body{random_inertia(draws)};
    const Transform<double> X_i = random_port(draws), X_j = random_port(draws);
    const Compliance<double> inboard = compliance(body);
    const Dense6 inverse = inverted(dense(body.inertia)), from = multiply(dense(X_i), inverse);
    const Matrix6<double> i0 = compliance(body, inboard, X_i);
    const Matrix6<double> ij = compliance(body, i0, X_j);
    const Dense6 want = multiply(from, transposed(dense(X_j)));
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c) {
        EXPECT_NEAR(i0[6 * r + c], from[r][c], 1e-10);
        EXPECT_NEAR(ij[6 * r + c], want[r][c], 1e-10);
      }
    expect_near(compliance(body, i0, X_i), multiply(from, transposed(dense(X_i))), "same port");
  }
}

// A body is the same wherever its frame is put: energies and momenta follow.
TEST(RigidBody, MovesToAnotherFrame) {
  Draws draws(2);
  const Vec3<double> g{0.3, -2, -9};
  for (int sample = 0; sample < 10; ++sample) {
    const RigidBody<double> body{random_inertia(draws)};
    const Transform<double> X = random_port(draws), from_world = random_port(draws);
    const RigidBody<double> there = moved(body, X);
    const Motion<double> v = random_motion(draws);
    EXPECT_NEAR(kinetic_energy(there, v), kinetic_energy(body, X * v), 1e-11);
    EXPECT_NEAR(potential_energy(there, from_world, g), potential_energy(body, X * from_world, g),
                1e-11);
    EXPECT_EQ(mass(there), mass(body));
    const Array6 found = to_array(momentum_bias(there, v)),
                 want = to_array(transpose_times(X, momentum_bias(body, X * v)));
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(found[i], want[i], 1e-10);
  }
}

// Weight times height of the centre of mass.
TEST(RigidBody, PotentialEnergyIsWeightTimesHeight) {
  const RigidBody<double> body{{2, {0.2, 0, 0.6}, {}}};  // centre at (0.1, 0, 0.3)
  const Transform<double> X{Mat3<double>::identity(), {1, 2, 3}};
  EXPECT_NEAR(potential_energy(body, X, {0, 0, -10}), 2 * 10 * 3.3, 1e-13);
}

}  // namespace
}  // namespace linkwise::testing
