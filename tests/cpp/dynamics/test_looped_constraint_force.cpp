// All joint constraint forces of machines with closed loops at once, against the recursion that
// eliminates loops, which shares nothing with it but the joints; and against Newton and Euler.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/error_of.hpp"
#include "dynamics/dynamics_case.hpp"
#include "dynamics/looped_machine.hpp"
#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/dynamics/indeterminacy.hpp"
#include "linkwise/dynamics/loop_work.hpp"
#include "linkwise/dynamics/looped_constraint_force.hpp"

namespace linkwise::testing {
namespace {

DynamicsOptions by(const std::string& solver) {
  DynamicsOptions options;
  options.method = "constraint_force";
  options.solver = solver;
  options.solver_options.tolerance = 1e-12;
  return options;
}

struct Inputs {
  DynamicsCase c;
  std::vector<double> loop_tau;
  SweepInput<double> in;

  Inputs(const LoopedMachine& machine, std::uint64_t seed)
      : c(machine.tree, seed), loop_tau(machine.model.loops.nv), in(machine.input()) {
    Draws draws(seed + 1);
    for (double& x : loop_tau) x = draws.normal();
    in.tau = c.tau.data();
    in.prescribed = c.given.data();
    in.external = c.external.data();
    in.loop_tau = loop_tau.data();
  }
};

double largest(const std::vector<double>& x) {
  double size = 1;
  for (const double xi : x) size = std::max(size, std::abs(xi));
  return size;
}

/// Accelerations and determinate loads are those of the recursion; all loads balance the bodies.
void expect_the_same(const LoopedMachine& machine, std::uint64_t seed, const std::string& solver) {
  const Model& model = machine.model;
  const Inputs given(machine, seed);
  std::vector<double> want(model.nv()), loads(6 * model.n_loads());
  ArticulatedLoops recursion(model);
  ASSERT_TRUE(recursion.evaluate(given.in, want.data(), loads.data()));
  std::vector<double> couplings;
  recursion.coupling_loads(given.in.q, couplings);

  LoopedConstraintForce method(model, by(solver));
  std::vector<double> du(model.nv()), got(6 * model.n_loads());
  const DynamicsReport report = method.evaluate(0, given.in, du.data(), got.data());
  ASSERT_TRUE(report.ok()) << to_string(report.outcome) << " at " << report.error_estimate;
  if (solver == "thomas") {
    EXPECT_EQ(report.loops.rows, recursion.report().rows);
    EXPECT_EQ(report.loops.rank, recursion.report().rank);
  }
  const double allowed = solver == "thomas" ? 1e-10 : 1e-9;
  for (int i = 0; i < model.nv(); ++i) EXPECT_NEAR(du[i], want[i], allowed * largest(want)) << i;

  std::vector<char> known(loads.size(), 1);
  if (recursion.report().rank < recursion.report().rows) {
    for (int g = 0; g < static_cast<int>(recursion.groups().size()); ++g)
      for (int k = recursion.find_self_stresses(g); k-- > 0;) {
        std::vector<double> stress(loads.size());
        recursion.self_stress(g, k, given.in.q, stress.data());
        for (size_t i = 0; i < loads.size(); ++i)
          if (std::abs(stress[i]) > 1e-8 * largest(stress)) known[i] = 0;
      }
  } else {
    for (size_t i = 0; i < couplings.size(); ++i)
      EXPECT_NEAR(method.coupling_load()[i], couplings[i], 1e-9 * largest(loads));
  }
  for (size_t i = 0; i < loads.size(); ++i)
    if (known[i]) {
      EXPECT_NEAR(got[i], loads[i], 1e-9 * largest(loads)) << "load " << i;
    }
  // Asked for loads or not: the same accelerations.
  std::vector<double> again(model.nv());
  ASSERT_TRUE(method.evaluate(0, given.in, again.data(), nullptr).ok());
  for (int i = 0; i < model.nv(); ++i) EXPECT_NEAR(again[i], du[i], allowed * largest(want));

  std::vector<double> external = given.c.external;
  for (int l = 0; l < model.n_loops(); ++l) {
    const LoopJoint& loop = model.loops.joints[l];
    const Force<double> w = transpose_times(
        loop.joint.to_user, to_force(&got[6 * (static_cast<size_t>(model.n_joints()) + l)]));
    machine.push(loop.joint.body, wrench_on_b(loop, w), external);
    machine.push(loop.parent_body, wrench_on_a(recursion.states()[l], w), external);
  }
  const auto balance = WorldTwin(machine.tree).inverse_dynamics(machine.q, machine.v, du, external);
  for (size_t i = 0; i < balance.loads.size(); ++i)
    EXPECT_NEAR(got[i], balance.loads[i], 1e-9 * largest(got)) << "load " << i;
}

/// Trees with armatures, given motions and loops of all types, one of them twice.
LoopedMachine random_machine(int sample, Draws& draws) {
  const int n = 4 + draws.below(14);
  const std::vector<JointType> types = random_types(n, draws);
  ModelSpec spec = tree_spec(types, random_parents(n, draws), draws);
  spec.floating_base = sample % 3 == 0;
  for (int j = 0; j < n && sample % 4 == 0; ++j)
    if (types[j] == JointType::revolute || types[j] == JointType::prismatic)
      spec.joints[j].dof.push_back({DofProperty::armature, {draws.uniform(0.1, 2)}});
  LoopedMachine machine(spec, draws);
  const int bodies = machine.tree.n_bodies();
  for (int l = 1 + draws.below(4); bodies > 1 && l > 0; --l) {
    const int a = draws.below(bodies + 1) - 1;
    int b = draws.below(bodies + 1) - 1;
    if (a == b) b = a < bodies - 1 ? a + 1 : a - 1;
    machine.close(all_joint_types[draws.below(static_cast<int>(JointType::composite))], a, b,
                  draws);
    if (sample % 4 == 1 && l == 1) machine.close_again();
    if (sample % 5 == 2) machine.close_rod(a, b, draws);
  }
  if (sample % 3 == 1) machine.couple(1 + draws.below(4), draws, sample % 2 == 0);
  if (sample % 6 == 3) machine.add_rotors(draws);
  return machine;
}

TEST(LoopedConstraintForce, IsTheRecursionOnRandomMachines) {
  for (int sample = 0; sample < 80; ++sample) {
    SCOPED_TRACE(sample);
    Draws draws(300 + sample);
    LoopedMachine machine = random_machine(sample, draws);
    if (!machine.model.is_constrained()) continue;
    machine.make_consistent();
    expect_the_same(machine, sample, "thomas");
    if (sample % 4 == 2) expect_the_same(machine, sample, "conjugate_gradient");
  }
}

TEST(LoopedConstraintForce, EveryJointTypeClosesALoopAndFollowsAGivenMotion) {
  for (const JointType type : all_joint_types) {
    if (type == JointType::composite) continue;
    SCOPED_TRACE(joint_type_name(type));
    for (const bool given : {false, true})
      for (const int a : {-1, 7}) {
        Draws draws(32);
        LoopedMachine machine(
            tree_spec({JointType::revolute, JointType::universal, JointType::spherical,
                       JointType::prismatic, JointType::spherical, JointType::revolute,
                       JointType::universal, JointType::spherical},
                      {-1, 0, 1, 2, 1, 4, 5, 6}, draws),
            draws);
        machine.close(type, a, 3, draws);
        machine.make_consistent();
        if (given) machine.prescribe(0, draws);
        expect_the_same(machine, 5, "thomas");
      }
  }
}

TEST(LoopedConstraintForce, RowsOfFourBarsAreRedundantAndPlain) {
  for (const int n : {1, 13, 60}) {
    LoopedMachine machine(row_of_four_bars(n));
    for (int i = 0; i < machine.tree.nv(); ++i) machine.v[i] = i % 2 == 0 ? 0.7 : -0.7;
    expect_the_same(machine, 3, "thomas");
  }
}

// Of all forces that move a redundant machine alike, those of least f^T D f, whichever joint of a
// ring is the one that closes it: all four hinges of a four-bar in turn.
TEST(LoopedConstraintForce, LoadsDoNotDependOnTheJointThatClosesTheLoop) {
  ModelSpec spec = row_of_four_bars(1);
  // The ring base - rod0 - bar0 - rod1 - base. Cut at `right0`, or at `pin1`.
  ModelSpec other = spec;
  JointSpec right = spec.loop_joints[0].joint, pin;
  std::erase_if(other.joints, [&](const JointSpec& joint) {
    if (joint.name != "pin1") return false;
    pin = joint;
    return true;
  });
  other.loop_joints.clear();
  // rod1 hangs on the bar by its tip, and its foot closes the loop.
  for (LinkSpec& link : other.links)
    if (link.name == "rod1") link.com = {0, -0.5, 0};
  other.joints.push_back(right);
  LoopJointSpec closing;
  closing.joint = pin;
  closing.child_translation = {0, -1, 0};
  other.loop_joints.push_back(closing);
  std::vector<std::vector<double>> of_ring;
  for (const ModelSpec* one : {&spec, &other}) {
    const Model model(*one);
    const std::vector<double> q = model.neutral_configuration(), none(model.nv());
    std::vector<double> du(model.nv()), loads(6 * model.n_loads());
    SweepInput<double> in;
    in.q = q.data();
    in.tau = none.data();
    const auto method = make_dynamics(model, by("thomas"));
    ASSERT_TRUE(method->evaluate(0, in, du.data(), loads.data()).ok());
    of_ring.push_back({});
    for (const char* name : {"pin0", "left0", "right0", "pin1"})
      for (int i = 0; i < 6; ++i)
        of_ring.back().push_back(loads[6 * static_cast<size_t>(model.load_index(name)) + i]);
  }
  for (size_t i = 0; i < of_ring[0].size(); ++i)
    EXPECT_NEAR(of_ring[0][i], of_ring[1][i], 1e-6 * largest(of_ring[0])) << i;
}

// Light bodies between heavy ones take the digits of A. What comes out is right, or refused.
TEST(LoopedConstraintForce, BodiesOfUnlikeMassAreRightOrRefused) {
  int right = 0;
  for (const double light : {1e-3, 1e-6, 1e-9, 1e-12, 1e-15}) {
    SCOPED_TRACE(light);
    Draws draws(8);
    const std::vector<JointType> types(9, JointType::revolute);
    ModelSpec spec = tree_spec(types, random_parents(9, draws), draws);
    for (size_t i = 3; i < spec.links.size(); i += 2) {
      spec.links[i].mass *= light;
      for (double& x : spec.links[i].inertia.m) x *= light;
    }
    LoopedMachine machine(spec, draws);
    machine.close(JointType::spherical, -1, 8, draws);
    machine.make_consistent();
    const Inputs given(machine, 2);
    std::vector<double> want(machine.model.nv()), loads(6 * machine.model.n_loads()), du = want,
                                                                                      got = loads;
    ArticulatedLoops recursion(machine.model);
    ASSERT_TRUE(recursion.evaluate(given.in, want.data(), loads.data()));
    LoopedConstraintForce method(machine.model, by("thomas"));
    if (!method.evaluate(0, given.in, du.data(), got.data()).ok()) continue;
    ++right;
    std::vector<double> external = given.c.external;
    const LoopJoint& loop = machine.model.loops.joints[0];
    const Force<double> w =
        transpose_times(loop.joint.to_user, to_force(&got[6 * machine.model.n_joints()]));
    machine.push(loop.joint.body, wrench_on_b(loop, w), external);
    const auto balance =
        WorldTwin(machine.tree).inverse_dynamics(machine.q, machine.v, du, external);
    for (size_t i = 0; i < du.size(); ++i) {
      EXPECT_NEAR(du[i], want[i], 1e-7 * largest(want)) << i;
      EXPECT_NEAR(balance.tau[i], given.c.tau[i], 1e-9 * largest(got)) << i;
    }
    for (size_t i = 0; i < balance.loads.size(); ++i)
      EXPECT_NEAR(got[i], balance.loads[i], 1e-9 * largest(got)) << i;
  }
  EXPECT_GE(right, 4);
}

// A row of four-bars on a floating body: one dense matrix of all pins for the graph, a band for the
// recursion. The order of elimination, which would take long, is not even looked for.
TEST(LoopWork, BodiesWithManyJointsAreLeftToTheRecursion) {
  ModelSpec spec = row_of_four_bars(20000);
  spec.links[0] = {"base", 1, {}, {{1, 0, 1, 0, 0, 1}}};
  spec.floating_base = true;
  const LoopWork work = count_loop_work(Model(spec));
  EXPECT_FALSE(work.prefers_graph());
  EXPECT_GT(work.graph, 1e13);
  EXPECT_LT(work.recursion, 1e9);
}

TEST(LoopedConstraintForce, RefusesWhatItDoesNotTake) {
  const Model model(row_of_four_bars(2));
  for (const char* solver : {"jacobi", "twisted", "two_level"})
    EXPECT_NE(error_of([&] { make_dynamics(model, by(solver)); }).find("takes trees"),
              std::string::npos);
  Draws draws(1);
  ModelSpec open = row_of_four_bars(1);
  open.loop_joints.clear();
  LoopedMachine machine(open);
  machine.close(JointType::spherical, 1, 1, draws);
  EXPECT_NE(error_of([&] {
              LoopedConstraintForce(machine.model, by("thomas"));
            }).find("links that move as one"),
            std::string::npos);
}

}  // namespace
}  // namespace linkwise::testing
