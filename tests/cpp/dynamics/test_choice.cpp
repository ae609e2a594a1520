// Which method "auto" picks, and what each refuses.
#include <string>

#include <gtest/gtest.h>

#include "base/error_of.hpp"
#include "dynamics/dynamics_case.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

DynamicsOptions with_method(const std::string& method) {
  DynamicsOptions options;
  options.method = method;
  return options;
}

ModelSpec two_links() {
  Draws draws(51);
  ModelSpec spec = tree_spec({revolute, spherical}, chain_parents(2), draws);
  spec.source = "arm.urdf";
  return spec;
}

TEST(Choice, AutoTakesTheRecursionUnlessASolverIsNamed) {
  const Model model(two_links());
  const Choice plain = choose_dynamics(model, {});
  EXPECT_EQ(plain.method, "articulated_body");
  EXPECT_EQ(plain.solver, "");
  EXPECT_FALSE(plain.reason.empty());
  DynamicsOptions options;
  options.solver = "conjugate_gradient";
  const Choice solver = choose_dynamics(model, options);
  EXPECT_EQ(solver.method, "constraint_force");
  EXPECT_EQ(solver.solver, "conjugate_gradient");
  EXPECT_EQ(choose_dynamics(model, with_method("constraint_force")).solver, "thomas");
}

TEST(Choice, UnknownNamesAreListed) {
  const Model model(two_links());
  std::string known = "auto";
  for (const DynamicsEntry& entry : dynamics_table()) known += ", " + std::string(entry.name);
  EXPECT_EQ(error_of([&] { make_dynamics(model, with_method("newton")); }),
            "method 'newton' is unknown; known: " + known);
  DynamicsOptions options;
  options.solver = "thoma";
  EXPECT_NE(error_of([&] { make_dynamics(model, options); }).find("'thoma'"), std::string::npos);
}

// Bodies whose 6x6 inertia is singular: the constraint forces need its inverse.
TEST(Choice, SingularBodiesAreNamedAndLeftToTheRecursion) {
  struct Case {
    double mass;
    Sym3<double> inertia;
  };
  const Case cases[] = {{1, {}}, {1, {{1, 0, 1, 0, 0, 0}}}, {0, {{1, 0, 1, 0, 0, 1}}}};
  for (const Case& c : cases) {
    ModelSpec spec = two_links();
    spec.links[1].mass = c.mass;
    spec.links[1].inertia = c.inertia;
    const Model model(spec);
    EXPECT_EQ(error_of([&] { make_dynamics(model, with_method("constraint_force")); }),
              "body 'link0' of arm.urdf has a singular inertia, which method constraint_force "
              "cannot take; give it mass and inertia about every axis, or use method "
              "articulated_body");
    const Choice choice = choose_dynamics(model, {});
    EXPECT_EQ(choice.method, "articulated_body");
    EXPECT_NE(choice.reason.find("body 'link0' has a singular inertia"), std::string::npos);
  }
}

TEST(Choice, MergedInertiasCount) {
  Draws draws(52);
  ModelSpec spec = tree_spec({revolute, fixed}, chain_parents(2), draws);
  spec.links[1].inertia = {};  // a particle, but with link1 welded to it
  EXPECT_EQ(Model(spec).singular_body(), -1);
  spec.links[2].inertia = {};  // two particles: nothing resists a turn about their line
  EXPECT_EQ(Model(spec).singular_body(), 0);
}

TEST(Choice, DenseMatricesHaveALimit) {
  Draws draws(53);
  const int n = 20001;
  const Model model(tree_spec(std::vector(n, revolute), chain_parents(n), draws));
  EXPECT_EQ(error_of([&] { make_dynamics(model, with_method("composite_rigid_body")); }),
            "method composite_rigid_body needs a dense 20001 x 20001 matrix (3 GB); use "
            "articulated_body above 20000 degrees of freedom");
}

// A particle on the axis of the last hinge: nothing resists, so no method can say how it turns.
TEST(Failure, IsReportedWithItsBody) {
  Draws draws(54);
  ModelSpec spec = tree_spec({spherical, prismatic, revolute}, chain_parents(3), draws);
  spec.links[3].com = {};
  spec.links[3].inertia = {};
  const Model model(spec);
  const DynamicsCase c(model, 55);
  for (const char* name : {"articulated_body", "composite_rigid_body",
                           "joint_space_conjugate_gradient", "global_projection"}) {
    std::vector<double> du(model.nv());
    const DynamicsReport report =
        make_dynamics(model, with_method(name))->evaluate(0, c.input(), du.data(), nullptr);
    EXPECT_EQ(report.outcome, Outcome::not_positive_definite) << name;
    EXPECT_EQ(report.body, 2) << name;
  }
  // With a rotor the hinge turns: the torque divided by the rotor's inertia.
  spec.joints[2].dof = {{DofProperty::armature, {0.25}}};
  const Model geared(spec);
  SweepInput<double> in = c.input();
  in.external = nullptr;
  for (const char* name : {"articulated_body", "composite_rigid_body",
                           "joint_space_conjugate_gradient", "global_projection"})
    EXPECT_NEAR(evaluate(*make_dynamics(geared, with_method(name)), geared, in).du[4],
                c.tau[4] / 0.25, 1e-9);
}

}  // namespace
}  // namespace linkwise::testing
