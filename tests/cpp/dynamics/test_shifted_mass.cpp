// (H + E)^-1 of every machine against dense Cholesky in extended precision.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/dynamics/shifted_mass.hpp"
#include "linkwise/model/flexible_link.hpp"

namespace linkwise::testing {
namespace {

/// By inverse dynamics at rest without gravity, one column after the other.
Dense mass_matrix(const Model& model, const double* q) {
  const int nv = model.nv();
  Dense H;
  H.size = nv;
  H.a.resize(static_cast<size_t>(nv) * nv);
  InverseDynamics<double> inverse(model);
  std::vector<double> unit(nv), tau(nv), loads(6 * static_cast<size_t>(model.n_loads()));
  for (int j = 0; j < nv; ++j) {
    unit.assign(nv, 0.0);
    unit[j] = 1;
    SweepInput<double> in;
    in.q = q;
    in.gravity_factor = 0;
    inverse.evaluate(in, unit.data(), tau.data(), loads.data());
    for (int i = 0; i < nv; ++i) H.at(i, j) = tau[i];
  }
  return H;
}

void expect_dense_solution(const Model& model, const double* q, double size) {
  const int nv = model.nv();
  Draws draws(43);
  std::vector<bool> given(nv, false);
  for (const Element& e : model.elements)
    for (int k = 0; k < e.nv; ++k) given[e.v + k] = e.prescribed;
  ShiftedMass mass(model);
  for (int pass = 0; pass < 2; ++pass) {  // nothing is left of the first
    Dense H = mass_matrix(model, q);
    std::vector<double> E(nv), tau(nv), du(nv);
    for (int i = 0; i < nv; ++i) {
      E[i] = i % 3 == 2 ? 0.0 : size * (1 + draws.uniform(-0.9, 0.9));
      tau[i] = given[i] ? 0.0 : draws.uniform(-1, 1);
      H.at(i, i) += E[i];
      for (int j = 0; j < nv; ++j)
        if (i != j && (given[i] || given[j])) H.at(i, j) = 0;
      if (given[i]) H.at(i, i) = 1;
    }
    const std::vector<double> want = cholesky_solve(H, tau);
    ASSERT_EQ(want.size(), H.a.empty() ? 0u : static_cast<size_t>(nv));
    ASSERT_TRUE(mass.factor(q, E.data()));
    double largest = 0;
    for (const double x : want) largest = std::max(largest, std::abs(x));
    for (int solution = 0; solution < 2; ++solution) {
      mass.solve(tau.data(), du.data());
      for (int i = 0; i < nv; ++i) EXPECT_NEAR(du[i], want[i], 1e-9 * largest) << i;
    }
  }
}

class ShiftedMasses : public ::testing::TestWithParam<Machine> {};

TEST_P(ShiftedMasses, SolveWhatDenseCholeskyDoes) {
  const Model model(GetParam().spec);
  Draws draws(44);
  const MachineState state = random_state(model, draws);
  for (const double size : {0.0, 1.0, 1e4}) expect_dense_solution(model, state.q.data(), size);
}

INSTANTIATE_TEST_SUITE_P(Machines, ShiftedMasses, ::testing::ValuesIn(all_machines()),
                         [](const auto& test) { return test.param.name; });

TEST(ShiftedMass, IsNotFactoredWhereItIsNotPositiveDefinite) {
  Draws draws(42);
  ModelSpec spec = tree_spec({JointType::revolute}, chain_parents(1), draws);
  spec.links[1].com = {};
  spec.links[1].inertia = {};
  spec.joints[0].axes[0].axis = {0, 0, 1};
  const Model model(spec);
  const double q = 0.3, none = 0, some = 2, torque = 3;
  ShiftedMass mass(model);
  EXPECT_FALSE(mass.factor(&q, &none));
  ASSERT_TRUE(mass.factor(&q, &some));
  double du = 0;
  mass.solve(&torque, &du);
  EXPECT_DOUBLE_EQ(du, 1.5);
}

}  // namespace
}  // namespace linkwise::testing
