// A and b of the constraint forces against stacked 6N matrices, written out in full.
#include <vector>

#include <gtest/gtest.h>

#include "kinematics/world_twin.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/constraint/tree_system.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {
namespace {

using Rows = std::vector<std::vector<double>>;

Rows zeros(size_t rows, size_t columns) { return Rows(rows, std::vector<double>(columns)); }
Rows product(const Rows& a, const Rows& b) {
  Rows c = zeros(a.size(), b.empty() ? 0 : b[0].size());
  for (size_t i = 0; i < a.size(); ++i)
    for (size_t k = 0; k < b.size(); ++k)
      for (size_t j = 0; j < c[i].size(); ++j) c[i][j] += a[i][k] * b[k][j];
  return c;
}
Rows transposed(const Rows& a, size_t columns) {
  Rows t = zeros(columns, a.size());
  for (size_t i = 0; i < a.size(); ++i)
    for (size_t j = 0; j < columns; ++j) t[j][i] = a[i][j];
  return t;
}
void set_block(Rows& a, int i, int j, const Dense6& block, double factor = 1) {
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) a[6 * i + r][6 * j + c] = factor * block[r][c];
}

struct StackedSystem {
  Rows A;
  std::vector<double> b;
};

/// With all bodies' accelerations in one vector a: relative motion at the joints G a, bodies
/// M a = G^T w + g, wrenches w = known + B f, and joints B^T (G a - c) = 0 (a compliance on
/// degrees of freedom with a rotor).
StackedSystem stacked_system(const Model& model, const SweepInput<double>& in) {
  const int n = model.n_bodies();
  std::vector<BodyState<double>> states(n);
  std::vector<GeneralState<double>> general(model.n_general);
  calc_body_states(model, in, states.data(), general.data());
  Rows G = zeros(6 * n, 6 * n), W = zeros(6 * n, 6 * n), g = zeros(6 * n, 1), c = zeros(6 * n, 1);
  Rows known = zeros(6 * n, 1), B = zeros(6 * n, 0);
  std::vector<double> compliance, tau_over_armature;
  const auto& armature = model.dof_values(DofProperty::armature);
  const Motion<double> ground = ground_acceleration<double>(model, in.gravity_factor);
  for (int i = 0; i < n; ++i) {
    const BodyTopology& body = model.topology[i];
    Dense6 unit{};
    for (int r = 0; r < 6; ++r) unit[r][r] = 1;
    set_block(G, i, i, unit);
    if (body.parent >= 0) set_block(G, i, body.parent, dense(states[i].X), -1);
    set_block(W, i, i, inverted(dense(model.constants[i].rigid.inertia)));
    Motion<double> given = states[i].c;
    if (body.parent < 0) given += states[i].X * ground;

    Motion<double> column = element_column<double>(model.elements[body.first_element], 0);
    const bool is_general = body.joint_kind == JointKind::general;
    const Motion<double>* P = is_general ? general[body.general].P : &column;
    const int* dof = is_general ? general[body.general].dof : &body.v;
    JointConstraint<double> joint;
    calc_joint_constraint(P, dof, is_general ? general[body.general].n : 1, armature, joint);
    for (int r = 0; r < 6; ++r) {
      g[6 * i + r][0] = -to_array(states[i].bias)[r];
      c[6 * i + r][0] = to_array(given)[r];
      for (int k = 0; k < joint.free; ++k)
        if (!(armature[joint.dof[k]] > 0))
          known[6 * i + r][0] += in.tau[joint.dof[k]] * joint.dual[k][r];
    }
    for (int k = 0; k < joint.rows; ++k) {
      for (int r = 0; r < 6 * n; ++r) B[r].push_back(0);
      for (int r = 0; r < 6; ++r) B[6 * i + r].back() = joint.B[k][r];
      compliance.push_back(joint.compliance[k]);
      const int geared = joint.armature_of[k];
      tau_over_armature.push_back(geared < 0 ? 0 : in.tau[geared] / armature[geared]);
    }
  }
  const Rows GT = transposed(G, 6 * n), BT = transposed(B, compliance.size());
  StackedSystem out{product(BT, product(G, product(W, product(GT, B)))), {}};
  Rows load = product(GT, known);
  for (int r = 0; r < 6 * n; ++r) load[r][0] += g[r][0];
  Rows gap = product(G, product(W, load));
  for (int r = 0; r < 6 * n; ++r) gap[r][0] = c[r][0] - gap[r][0];
  const Rows projected = product(BT, gap);
  for (size_t k = 0; k < compliance.size(); ++k) {
    out.A[k][k] += compliance[k];
    out.b.push_back(projected[k][0] + tau_over_armature[k]);
  }
  return out;
}

class TreeSystems : public ::testing::TestWithParam<Machine> {};

TEST_P(TreeSystems, EqualTheStackedSystem) {
  const Model model(GetParam().spec);
  Draws draws(91);
  const MachineState state = random_state(model, draws);
  const std::vector<double> tau = random_values(model.nv(), draws),
                            given = random_values(model.nv(), draws),
                            external = random_values(6 * model.n_joints(), draws);
  SweepInput<double> in;
  in.q = state.q.data();
  in.v = state.v.data();
  in.tau = tau.data();
  in.prescribed = given.data();
  in.external = external.data();
  TreeSystem system(model);
  system.assemble(in);
  system.A().check_consistency();
  EXPECT_TRUE(system.A().all_finite());
  const Dense A = dense_twin(system.A());
  const StackedSystem want = stacked_system(model, in);
  ASSERT_EQ(want.b.size(), static_cast<size_t>(A.size));
  double scale_A = 1, scale_b = 1;
  for (int i = 0; i < A.size; ++i) {
    scale_A = std::max(scale_A, want.A[i][i]);
    scale_b = std::max(scale_b, std::abs(want.b[i]));
  }
  for (int i = 0; i < A.size; ++i) {
    for (int j = 0; j < A.size; ++j)
      ASSERT_NEAR(A.at(i, j), want.A[i][j], 1e-12 * scale_A) << i << " " << j;
    EXPECT_NEAR(system.b()[i], want.b[i], 1e-11 * scale_b) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, TreeSystems, ::testing::ValuesIn(regular_machines()),
                         [](const auto& test) { return test.param.name; });

// dual^T P = 1 within the columns' span, the complement is orthonormal and lets nothing of P
// through: for screws, stacks, and plain translations and rotations, which take another path.
TEST(JointConstraint, DualAndComplementOfAnyColumns) {
  Draws draws(92);
  for (int n = 0; n <= 6; ++n)
    for (int kind = 0; kind < 3; ++kind)
      for (int sample = 0; sample < 10; ++sample) {
        Motion<double> P[6];
        int dof[6];
        const int slides =
            std::max(0, n - 3) + draws.below(std::min(n, 3) - std::max(0, n - 3) + 1);
        for (int i = 0; i < n; ++i) {
          dof[i] = i;
          const bool turns = i >= slides;
          if (kind == 0 || !turns) P[i].lin = random_vector3(draws);
          if (kind == 0 || turns) P[i].ang = random_vector3(draws);
          if (kind == 2) {  // unit vectors, of either sign
            const int k = 3 * turns + (turns ? i - slides : i);
            double unit[6] = {};
            unit[k] = draws.below(2) ? 1 : -1;
            P[i] = to_motion(unit);
          }
        }
        std::vector<double> armature(6);
        for (int i = 0; i < n; ++i) armature[i] = draws.below(2) ? draws.uniform(0.1, 2) : 0;
        JointConstraint<double> joint;
        calc_joint_constraint(P, dof, n, armature, joint);
        const auto product = [](const Vector6<double>& a, const Vector6<double>& b) {
          double sum = 0;
          for (int i = 0; i < 6; ++i) sum += a[i] * b[i];
          return sum;
        };
        int geared = 0;
        for (int i = 0; i < n; ++i) {
          for (int k = 0; k < n; ++k)
            EXPECT_NEAR(product(joint.dual[i], to_array(P[k])), i == k, 1e-11);
          if (!(armature[i] > 0)) continue;
          EXPECT_EQ(joint.armature_of[geared], i);
          EXPECT_EQ(joint.compliance[geared], 1 / armature[i]);
          EXPECT_EQ(joint.B[geared], joint.dual[i]);
          ++geared;
        }
        ASSERT_EQ(joint.rows, 6 - n + geared);
        for (int r = geared; r < joint.rows; ++r) {
          EXPECT_EQ(joint.armature_of[r], -1);
          EXPECT_EQ(joint.compliance[r], 0);
          for (int i = 0; i < n; ++i) {
            EXPECT_NEAR(product(joint.B[r], to_array(P[i])), 0, 1e-12);
            EXPECT_NEAR(product(joint.B[r], joint.dual[i]), 0, 1e-11);
          }
          for (int k = geared; k < joint.rows; ++k)
            EXPECT_NEAR(product(joint.B[r], joint.B[k]), r == k, 1e-14);
        }
      }
}

TEST(TreeSystem, RefusesASingularBodyByName) {
  Draws draws(93);
  ModelSpec spec = tree_spec({JointType::revolute, JointType::revolute}, chain_parents(2), draws);
  spec.links[2].inertia = {};
  const Model model(spec);
  try {
    TreeSystem system(model);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "body 'link1' has a singular inertia, which method constraint_force cannot take; "
                 "give it mass and inertia about every axis, or use method articulated_body");
  }
}

}  // namespace
}  // namespace linkwise::testing
