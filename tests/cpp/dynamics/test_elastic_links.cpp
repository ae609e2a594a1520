// Machines with elastic links: the recursion against inverse dynamics, lanes, other right-hand
// sides, and what each coordinate yields.
#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/dynamics/mobility.hpp"
#include "linkwise/model/flexible_link.hpp"

namespace linkwise::testing {
namespace {

/// base - turntable - boom, elastic, of two beams - wrist - hand; and a stiff tail that hangs on
/// the boom's end by a ball.
ModelSpec machine(int bodies, bool floating = false) {
  ModelSpec spec;
  spec.floating_base = floating;
  spec.gravity = {0.3, -0.5, -9.81};
  spec.links = {{"base", 5, {0, 0.1, 0}, {{1, 0, 1.2, 0, 0, 0.9}}},
                {"boom", 2, {}, {}},
                {"hand", 0.5, {0, 0, 0.1}, {{0.1, 0, 0.2, 0, 0, 0.15}}},
                {"tail", 0.4, {0.1, 0, 0}, {{0.1, 0, 0.1, 0, 0, 0.15}}}};
  const auto add = [&](const char* name, JointType type, const char* parent, const char* child) {
    JointSpec joint;
    joint.name = name;
    joint.type = type;
    joint.parent = parent;
    joint.child = child;
    spec.joints.push_back(joint);
  };
  add("turn", JointType::universal, "base", "boom");
  add("wrist", JointType::revolute, "boom", "hand");
  add("ball", JointType::spherical, "boom", "tail");
  spec.joints[0].axes = {{AxisKind::revolute, {0, 0, 1}, 0}, {AxisKind::revolute, {0, 1, 0}, 0}};
  spec.joints[1].axes = {{AxisKind::revolute, {0.6, 0.8, 0}, 0}};
  spec.joints[1].translation = spec.joints[2].translation = {0.9, 0.2, 0.4};
  FlexibleLink boom;
  boom.link = "boom";
  boom.E = 2e9;
  boom.G = 8e8;
  boom.area = 1e-3;
  boom.Iy = 3e-7;
  boom.Iz = 2e-7;
  boom.J = 1e-7;
  boom.bodies = bodies;
  boom.interior_modes = 1;
  return with_flexible_link(spec, boom);
}

DynamicsCase small_case(const Model& model, std::uint64_t seed) {
  DynamicsCase out(model, seed);
  for (const Element& e : model.elements)
    for (int k = 0; e.kind == ElementKind::elastic && k < e.nq; ++k) out.state.q[e.q + k] *= 0.02;
  return out;
}

class ElasticLinks : public ::testing::TestWithParam<std::pair<int, bool>> {
 protected:
  const Model model{machine(GetParam().first, GetParam().second)};
  std::vector<double> du = std::vector<double>(model.nv()), want = du;
  std::vector<double> loads = std::vector<double>(6 * model.n_joints()), want_loads = loads;
};

TEST_P(ElasticLinks, TakeTheTorquesThatMoveThem) {
  const DynamicsCase at = small_case(model, 7);
  ArticulatedBody<double> recursion(model);
  ASSERT_TRUE(recursion.evaluate(at.input(), du.data(), loads.data()));
  std::vector<double> tau(model.nv());
  InverseDynamics<double>(model).evaluate(at.input(), du.data(), tau.data(), want_loads.data());
  for (int i = 0; i < model.nv(); ++i) EXPECT_NEAR(tau[i], at.tau[i], 1e-9);
  for (size_t i = 0; i < loads.size(); ++i) EXPECT_NEAR(loads[i], want_loads[i], 1e-10);
}

TEST_P(ElasticLinks, AnswerOtherRightHandSides) {
  const DynamicsCase first = small_case(model, 7), other = small_case(model, 8);
  ArticulatedBody<double> kept(model), anew(model);
  ASSERT_TRUE(kept.evaluate(first.input(), du.data(), loads.data()));
  for (const bool moving : {true, false}) {
    SweepInput<double> in = other.input();
    in.q = first.state.q.data();
    if (!moving) in.v = nullptr;
    ASSERT_TRUE(anew.evaluate(in, want.data(), want_loads.data()));
    kept.evaluate_again(in, du.data(), loads.data());
    for (int i = 0; i < model.nv(); ++i)
      EXPECT_NEAR(du[i], want[i], 1e-9 * (1 + std::abs(want[i]))) << i;
    for (size_t i = 0; i < loads.size(); ++i)
      EXPECT_NEAR(loads[i], want_loads[i], 1e-10 * (1 + std::abs(want_loads[i]))) << i;
  }
}

TEST_P(ElasticLinks, AreTheSameOnLanes) {
  using Two = Lanes<2>;
  const DynamicsCase cases[] = {small_case(model, 3), small_case(model, 4)};
  std::vector<Two> q(model.nq()), v(model.nv()), tau(model.nv()), du2(model.nv());
  for (int lane = 0; lane < 2; ++lane) {
    for (int i = 0; i < model.nq(); ++i) q[i][lane] = cases[lane].state.q[i];
    for (int i = 0; i < model.nv(); ++i) {
      v[i][lane] = cases[lane].state.v[i];
      tau[i][lane] = cases[lane].tau[i];
    }
  }
  SweepInput<Two> in;
  in.q = q.data();
  in.v = v.data();
  in.tau = tau.data();
  ASSERT_TRUE(ArticulatedBody<Two>(model).evaluate(in, du2.data(), nullptr));
  for (int lane = 0; lane < 2; ++lane) {
    SweepInput<double> alone = cases[lane].input();
    alone.external = nullptr;
    alone.prescribed = nullptr;
    ASSERT_TRUE(ArticulatedBody<double>(model).evaluate(alone, want.data(), nullptr));
    for (int i = 0; i < model.nv(); ++i)
      EXPECT_NEAR(du2[i][lane], want[i], 1e-9 * (1 + std::abs(want[i])));
  }
}

TEST_P(ElasticLinks, YieldAsTheInverseOfTheMassMatrix) {
  const DynamicsCase at = small_case(model, 11);
  const int nv = model.nv();
  Dense H;
  H.size = nv;
  H.a.resize(static_cast<size_t>(nv) * nv);
  InverseDynamics<double> dynamics(model);
  SweepInput<double> in;
  in.q = at.state.q.data();
  in.gravity_factor = 0;
  std::vector<double> unit(nv, 0.0), tau(nv);
  for (int k = 0; k < nv; ++k) {
    unit[k] = 1;
    dynamics.evaluate(in, unit.data(), tau.data(), nullptr);
    for (int i = 0; i < nv; ++i) H.a[static_cast<size_t>(i) * nv + k] = tau[i];
    unit[k] = 0;
  }
  Mobility mobility(model);
  const std::span<const double> found = mobility.evaluate(at.state.q.data());
  ASSERT_EQ(found.size(), static_cast<size_t>(nv));
  for (int i = 0; i < nv; ++i) {
    unit[i] = 1;
    const std::vector<double> column = cholesky_solve(H, unit);
    ASSERT_FALSE(column.empty());
    EXPECT_NEAR(found[i], column[i], 1e-8 * column[i]) << i;
    unit[i] = 0;
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, ElasticLinks,
                         ::testing::Values(std::pair(1, false), std::pair(3, false),
                                           std::pair(2, true)));

TEST(ElasticLinksOfAModel, ShareTheirModes) {
  const Model model(machine(4));
  std::vector<const BeamModes*> modes;
  for (int n = 0; n < model.n_bodies(); ++n)
    if (model.topology[n].body_kind == BodyKind::beam)
      modes.push_back(
          std::get<std::vector<Beam>>(model.other_bodies)[model.topology[n].of_kind].modes.get());
  ASSERT_EQ(modes.size(), 4u);
  EXPECT_EQ(modes[1], modes[2]);  // the first one is turned against its link
  EXPECT_EQ(modes[2], modes[3]);
}

}  // namespace
}  // namespace linkwise::testing
