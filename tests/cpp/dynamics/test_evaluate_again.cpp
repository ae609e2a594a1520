// Kernels that keep their factors: those of one evaluation serve any other right-hand side at the
// same position.

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/constraint_elimination.hpp"

namespace linkwise::testing {
namespace {

std::vector<Machine> machines() {
  std::vector<Machine> all = all_machines();
  for (Machine& machine : one_axis_machines()) all.push_back(std::move(machine));
  return all;
}

class Again : public ::testing::TestWithParam<Machine> {
 protected:
  template <class Kernel>
  void equals_anew(double tolerance) {
    const Model model(GetParam().spec);
    Kernel kept(model), anew(model);
    const DynamicsCase first(model, 56), other(model, 57);
    const std::vector<double> none(model.nv());
    std::vector<double> du(model.nv(), NAN), loads(6 * model.n_joints(), NAN), want(du),
        want_loads(loads);
    ASSERT_TRUE(kept.evaluate(first.input(), du.data(), loads.data()));
    for (const std::string only : {"all", "rest", "gravity", "velocity", "motion", "external"}) {
      const auto is = [&](const char* cause) { return only == "all" || only == cause; };
      SweepInput<double> in = other.input();
      in.q = first.state.q.data();
      if (!is("velocity")) in.v = nullptr;
      if (!is("drive")) in.tau = none.data();
      if (!is("motion")) in.prescribed = nullptr;
      if (!is("external")) in.external = nullptr;
      if (!is("gravity")) in.gravity_factor = 0;
      ASSERT_TRUE(anew.evaluate(in, want.data(), want_loads.data()));
      kept.evaluate_again(in, du.data(), loads.data());
      expect_close(du, want, tolerance, only + ", accelerations");
      expect_close(loads, want_loads, tolerance, only + ", loads");
    }
  }
};

TEST_P(Again, EqualsAnewByTheRecursion) { equals_anew<ArticulatedBody<double>>(1e-12); }

TEST_P(Again, EqualsAnewByElimination) {
  if (GetParam().regular) equals_anew<ConstraintElimination<double>>(1e-12);
}

INSTANTIATE_TEST_SUITE_P(Machines, Again, ::testing::ValuesIn(machines()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace linkwise::testing
