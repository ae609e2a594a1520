// Identities between the constraint forces, the accelerations and the loads that follow from them.
#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/dynamics/constraint_force.hpp"

namespace linkwise::testing {
namespace {

DynamicsOptions thomas() {
  DynamicsOptions options;
  options.method = "constraint_force";
  options.solver = "thomas";
  return options;
}

class ConstraintForces : public ::testing::TestWithParam<Machine> {};

/// sum of a . w over the bodies and of the transmitted torque squared over the armature, for a
/// change dw of the joint loads that comes from a change of f: each body is accelerated by what its
/// joints pass on. In world axes, on the user's own links.
double energy_of_change(const Model& model, const std::vector<double>& q,
                        const std::vector<double>& dw) {
  const auto motions = WorldTwin(model).motions(q, std::vector<double>(model.nv()));
  const size_t n = model.n_bodies();
  std::vector<Vec3<double>> force(n), moment(n);  // about the world origin
  double energy = 0;
  for (const JointInfo& joint : model.joints) {
    if (!joint.last_of_body) continue;
    const Pose<double>& at = motions.pose[joint.link];
    const double* w = &dw[6 * (&joint - model.joints.data())];
    const Vec3<double> f = at.R * Vec3<double>{w[0], w[1], w[2]};
    const Vec3<double> m = at.R * Vec3<double>{w[3], w[4], w[5]} + cross(at.p, f);
    force[joint.body] += f;
    moment[joint.body] += m;
    if (const int parent = model.topology[joint.body].parent; parent >= 0) {
      force[parent] -= f;
      moment[parent] -= m;
    }
  }
  for (const JointInfo& joint : model.joints)
    for (int k = joint.v; k < joint.v + joint.nv; ++k) {
      const double armature = model.dof_values(DofProperty::armature)[k];
      const Element& e = model.elements[joint.first_element];
      if (!(armature > 0) || e.prescribed) continue;
      // The torque that a degree of freedom transmits, at its own joint.
      const Pose<double>& at = motions.pose[joint.link];
      const double* w = &dw[6 * (&joint - model.joints.data())];
      const Vec3<double> f = at.R * Vec3<double>{w[0], w[1], w[2]};
      const Vec3<double> m = at.R * Vec3<double>{w[3], w[4], w[5]} + cross(at.p, f);
      const double torque = dot(motions.dof[k].w, m) + dot(motions.dof[k].s, f);
      energy += torque * torque / armature;
    }
  // Bodies: all links that share a joint's frame, as one dense inertia about the world origin.
  for (size_t b = 0; b < n; ++b) {
    Dense6 M{};
    for (size_t l = 0; l < model.links.size(); ++l) {
      const int j = model.links[l].joint;
      if (j < 0 || model.joints[j].body != static_cast<int>(b)) continue;
      const LinkSpec& link = model.spec().links[l];
      const Pose<double>& at = motions.pose[l];
      const Vec3<double> c = at.p + at.R * link.com;
      const Mat3<double> spin = at.R * (full(link.inertia) * transpose(at.R));
      const Mat3<double> shift = transpose(tilde(c)) * tilde(c);
      for (int i = 0; i < 3; ++i) {
        M[i][i] += link.mass;
        for (int k = 0; k < 3; ++k) {
          M[i][3 + k] -= link.mass * tilde(c).m[3 * i + k];
          M[3 + i][k] += link.mass * tilde(c).m[3 * i + k];
          M[3 + i][3 + k] += spin.m[3 * i + k] + link.mass * shift.m[3 * i + k];
        }
      }
    }
    const Array6 w{force[b].x, force[b].y, force[b].z, moment[b].x, moment[b].y, moment[b].z};
    const Array6 a = multiply(inverted(M), w);
    for (int i = 0; i < 6; ++i) energy += a[i] * w[i];
  }
  return energy;
}

// df^T A df = da^T M da: the A-norm of an error in the forces is the kinetic-energy norm of the
// accelerations that it causes. A comes from the assembly, da from the loads that recover() gives.
TEST_P(ConstraintForces, EnergyNormIsThatOfTheAccelerations) {
  const Model model(GetParam().spec);
  const DynamicsCase c(model, 41);
  ConstraintForce method(model, thomas());
  const Motion6 exact = evaluate(method, model, c.input());
  TreeSystem system(model);
  system.assemble(c.input());
  const Dense A = dense_twin(system.A());
  std::vector<double> f(method.constraint_force().begin(), method.constraint_force().end());
  Draws draws(42);
  const std::vector<double> df = random_values(A.size, draws);
  for (size_t i = 0; i < f.size(); ++i) f[i] += df[i];
  std::vector<double> du(model.nv()), dw(6 * model.n_joints());
  system.recover(c.input(), f, du.data(), dw.data());
  for (size_t i = 0; i < dw.size(); ++i) dw[i] -= exact.loads[i];
  const std::vector<double> A_df = multiply(A, df);
  double norm = 0;
  for (size_t i = 0; i < df.size(); ++i) norm += df[i] * A_df[i];
  EXPECT_NEAR(energy_of_change(model, c.state.q, dw), norm, 1e-9 * (1 + norm));
}

TEST_P(ConstraintForces, SolveTheirSystem) {
  const Model model(GetParam().spec);
  const DynamicsCase c(model, 43);
  ConstraintForce method(model, thomas());
  evaluate(method, model, c.input());
  const TreeSystem& system = method.system();
  system.A().check_consistency();
  const Dense A = dense_twin(system.A());
  const std::vector<double> f(method.constraint_force().begin(), method.constraint_force().end());
  expect_close(multiply(A, f), system.b(), 1e-9, "A f");
  const std::vector<double> dense_f = cholesky_solve(A, system.b());
  ASSERT_EQ(dense_f.size(), f.size()) << "not positive definite";
  expect_close(f, dense_f, 1e-8, "f");
}

INSTANTIATE_TEST_SUITE_P(Machines, ConstraintForces, ::testing::ValuesIn(regular_machines()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace linkwise::testing
