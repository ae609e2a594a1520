#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/dynamics/composite_rigid_body.hpp"
#include "linkwise/dynamics/mobility.hpp"

namespace linkwise::testing {
namespace {

class Mobilities : public ::testing::TestWithParam<Machine> {};

// The i-th column of H^-1 by dense Cholesky in extended precision.
TEST_P(Mobilities, AreTheDiagonalOfTheInverseMassMatrix) {
  const Model model(GetParam().spec);
  Draws draws(41);
  const MachineState state = random_state(model, draws);
  const int nv = model.nv();
  Dense H;
  H.size = nv;
  H.a.resize(static_cast<size_t>(nv) * nv);
  CompositeRigidBody(model).mass_matrix(state.q.data(), H.a.data());
  std::vector<bool> prescribed(nv, false);
  for (const Element& e : model.elements)
    for (int k = 0; k < e.nv; ++k) prescribed[e.v + k] = e.prescribed;
  Mobility mobility(model);
  for (int pass = 0; pass < 2; ++pass) {  // nothing is left of the first
    const std::span<const double> got = mobility.evaluate(state.q.data());
    ASSERT_EQ(got.size(), static_cast<size_t>(nv));
    for (int i = 0; i < nv; ++i) {
      std::vector<double> unit(nv, 0.0);
      unit[i] = 1;
      const std::vector<double> column = cholesky_solve(H, unit);
      ASSERT_FALSE(column.empty());
      EXPECT_NEAR(got[i], prescribed[i] ? 0 : column[i], 1e-9 * column[i]) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, Mobilities, ::testing::ValuesIn(all_machines()),
                         [](const auto& test) { return test.param.name; });

TEST(Mobility, IsEmptyWhereTheMassMatrixIsSingular) {
  Draws draws(42);
  ModelSpec spec = tree_spec({JointType::revolute}, chain_parents(1), draws);
  spec.links[1].com = {};
  spec.links[1].inertia = {};
  spec.joints[0].axes[0].axis = {0, 0, 1};
  const Model model(spec);
  const double q = 0.3;
  EXPECT_TRUE(Mobility(model).evaluate(&q).empty());
}

}  // namespace
}  // namespace linkwise::testing
