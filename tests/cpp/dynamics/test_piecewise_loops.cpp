// Chains in pieces with loops, against the recursion that carries unit forces body by body: what
// closes, where, how often, and to the last bit for any number of threads.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "dynamics/looped_machine.hpp"
#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/dynamics/chain_pieces.hpp"

namespace linkwise::testing {
namespace {

LoopedMachine chain(int n, Draws& draws) {
  return {tree_spec(std::vector(n, JointType::revolute), chain_parents(n), draws), draws};
}

/// Rods of all lengths with axes across a plane, which is turned against that of the ground.
LoopedMachine planar_chain(int n, Draws& draws) {
  ModelSpec spec;
  spec.links.push_back({"ground", 0, {}, {}});
  for (int i = 0; i < n; ++i) {
    const std::string k = std::to_string(i);
    const double x = draws.uniform(0.5, 1.5);
    spec.links.push_back(
        {"rod" + k, draws.uniform(0.5, 2), {x / 2, 0.1, 0.2}, {{0.05, 0.01, 0.2, 0, 0, 0.2}}});
    JointSpec joint;
    joint.name = "J" + k;
    joint.parent = spec.links[i].name;
    joint.child = "rod" + k;
    joint.translation = {i > 0 ? x : 0.3, 0.1 * i, 0};
    if (i == 0) joint.rotation = random_rotation(draws);
    joint.axes = {{AxisKind::revolute, {0, 0, 1}, 0}};
    spec.joints.push_back(joint);
  }
  return {spec, draws};
}

/// With what acts on it.
struct Loaded {
  DynamicsCase c;
  std::vector<double> loop_tau;
  SweepInput<double> in;

  Loaded(const LoopedMachine& machine, std::uint64_t seed)
      : c(machine.tree, seed), in(machine.input()) {
    Draws draws(seed + 1);
    loop_tau = random_values(machine.model.loops.nv, draws);
    in.tau = c.tau.data();
    in.external = c.external.data();
    in.loop_tau = loop_tau.data();
  }
};

struct Outcomes {
  std::vector<double> du, loads;
  LoopReport report;
};

Outcomes by_pieces(const LoopedMachine& machine, const SweepInput<double>& in, int threads = 1) {
  DynamicsOptions options;
  options.executor = Executor(threads);
  const Model& model = machine.model;
  Piecewise method(model, options);
  Outcomes out{std::vector<double>(model.nv()), std::vector<double>(6 * model.n_loads()), {}};
  const DynamicsReport report = method.evaluate(0, in, out.du.data(), out.loads.data());
  EXPECT_TRUE(report.ok()) << to_string(report.outcome);
  out.report = report.loops;
  return out;
}

void expect_recursion(const LoopedMachine& machine, std::uint64_t seed, const std::string& what) {
  const Loaded at(machine, seed);
  const Model& model = machine.model;
  ArticulatedLoops recursion(model);
  Outcomes want{std::vector<double>(model.nv()), std::vector<double>(6 * model.n_loads()), {}};
  ASSERT_TRUE(recursion.evaluate(at.in, want.du.data(), want.loads.data()));
  const Outcomes got = by_pieces(machine, at.in);
  expect_close(got.du, want.du, 1e-10, what + ", accelerations");
  expect_close(got.loads, want.loads, 1e-10, what + ", loads");
  EXPECT_EQ(got.report.rows, recursion.report().rows) << what;
  EXPECT_EQ(got.report.rank, recursion.report().rank) << what;
  EXPECT_LT(got.report.contradiction, 1e-9) << what;
  EXPECT_NEAR(got.report.open, recursion.report().open, 1e-12) << what;
}

TEST(PiecewiseLoops, EveryJointTypeHoldsTheEnd) {
  for (const int n : {16, 17, 40, 67, 130})
    for (const JointType type : all_joint_types) {
      Draws draws(static_cast<std::uint64_t>(n));
      LoopedMachine machine = chain(n, draws);
      machine.close(type, -1, n - 1, draws);
      machine.make_consistent();
      expect_recursion(machine, 5, std::to_string(n) + " " + std::string(joint_type_name(type)));
      if (type == JointType::fixed) continue;
      machine.add_rotors(draws);
      expect_recursion(machine, 6, "rotors " + std::string(joint_type_name(type)));
    }
}

TEST(PiecewiseLoops, AnyBodiesAreJoined) {
  const int n = 70;
  for (const auto& [a, b] : {std::pair{69, -1}, {-1, 40}, {12, 50}, {69, 3}, {30, 31}, {0, 69}}) {
    Draws draws(static_cast<std::uint64_t>(100 + a));
    LoopedMachine machine = chain(n, draws);
    machine.close(JointType::revolute, a, b, draws);
    machine.close_rod(b, a, draws);
    machine.make_consistent();
    expect_recursion(machine, 7, std::to_string(a) + " and " + std::to_string(b));
  }
}

TEST(PiecewiseLoops, SeveralLoopsShareTheChain) {
  Draws draws(3);
  LoopedMachine machine = chain(200, draws);
  machine.close(JointType::spherical, -1, 199, draws);
  machine.close(JointType::universal, 20, 90, draws);
  machine.close_rod(60, -1, draws);
  machine.close_rod(150, 90, draws);
  machine.close_rod(199, 0, draws);
  machine.make_consistent();
  expect_recursion(machine, 8, "five");
}

TEST(PiecewiseLoops, DependentConstraintsShareTheirLoad) {
  Draws draws(4);
  for (const int n : {30, 300}) {
    LoopedMachine twice = chain(n, draws);
    twice.close(JointType::spherical, -1, n - 1, draws);
    twice.close_again();
    twice.make_consistent();
    expect_recursion(twice, 9, "twice");
    // Where all axes are parallel, three rows of five are held for nothing.
    LoopedMachine flat = planar_chain(n, draws);
    flat.close(JointType::revolute, -1, n - 1, draws);
    LoopJoint& loop = flat.model.loops.joints.back();
    const auto end = body_poses(flat.tree, flat.q.data())[n - 1];
    loop.on_child = {Mat3<double>::identity(), {1, 0, 0}};
    loop.on_parent = loop.on_child * end;
    flat.model.loops.elements.back().placement = {Mat3<double>::identity(), {}};
    flat.q_loops = {0};
    ASSERT_EQ(flat.make_consistent(), 2);
    expect_recursion(flat, 10, "in a plane");
  }
}

TEST(PiecewiseLoops, GivenMotionsOfTheAnchor) {
  Draws draws(11);
  LoopedMachine machine = chain(50, draws);
  machine.close(JointType::revolute, -1, 49, draws);
  machine.make_consistent();
  machine.prescribe(0, draws);
  expect_recursion(machine, 12, "given");
}

TEST(PiecewiseLoops, RespondsAtRestAsTheRecursionDoes) {
  Draws draws(16);
  LoopedMachine machine = chain(100, draws);
  machine.close(JointType::spherical, -1, 99, draws);
  machine.close(JointType::revolute, 10, 60, draws);
  const Model& model = machine.model;
  Piecewise pieces(model, {});
  ArticulatedLoops recursion(model);
  const std::vector<double> asked = random_values(6 * model.n_loops(), draws);
  std::vector<double> got(model.nv()), want(model.nv());
  ASSERT_TRUE(pieces.respond(machine.q.data(), asked.data(), 1e-12, got.data()));
  ASSERT_TRUE(recursion.respond(machine.q.data(), asked.data(), 1e-12, want.data()));
  expect_close(got, want, 1e-10, "rates");
  // States are found without an evaluation, with and without rates.
  LoopStates states(model);
  SweepInput<double> in;
  in.q = machine.q.data();
  for (const bool moving : {true, false}) {
    in.v = moving ? machine.v.data() : nullptr;
    states.update(in);
    const LoopStates& found = pieces.find_loops(in);
    for (int l = 0; l < model.n_loops(); ++l)
      for (int i = 0; i < states[l].held; ++i) {
        EXPECT_NEAR(found[l].gap[i], states[l].gap[i], 1e-11);
        EXPECT_NEAR(found[l].slip[i], states[l].slip[i], 1e-10);
      }
  }
}

TEST(PiecewiseLoops, AnyNumberOfThreadsGivesTheSameBits) {
  for (const int n : {100, 3000}) {
    Draws draws(13);
    LoopedMachine machine = chain(n, draws);
    machine.close(JointType::spherical, -1, n - 1, draws);
    const Loaded at(machine, 14);
    SweepInput<double> in = at.in;
    in.v = nullptr;
    const Outcomes one = by_pieces(machine, in);
    for (const int threads : {2, 3, 7}) {
      const Outcomes several = by_pieces(machine, in, threads);
      EXPECT_EQ(one.du, several.du) << n << " on " << threads;
      EXPECT_EQ(one.loads, several.loads);
    }
  }
}

TEST(PiecewiseLoops, TakesNeitherCouplingsNorOtherSolvers) {
  Draws draws(15);
  LoopedMachine machine = chain(40, draws);
  machine.close(JointType::revolute, -1, 39, draws);
  EXPECT_TRUE(Piecewise::suits(machine.model));
  DynamicsOptions options;
  options.solver = "conjugate_gradient";
  EXPECT_THROW(Piecewise(machine.model, options), InputError);
  machine.couple(2, draws);
  EXPECT_FALSE(Piecewise::suits(machine.model));
  EXPECT_THROW(Piecewise(machine.model, {}), InputError);
}

TEST(ChainPieces, EndWhereTheyAreAskedTo) {
  for (const int n : {16, 17, 100, 333, 5000})
    for (const std::vector<int>& ends : {std::vector<int>{}, {n - 1}, {0}, {3, 7, n - 2}}) {
      const ChainPieces pieces(n, ends);
      int bodies = 0;
      for (int s = 0; s < pieces.count(); ++s) {
        EXPECT_LE(pieces.size(s), pieces.length());
        EXPECT_EQ(pieces.first(s), bodies);
        bodies += pieces.size(s);
      }
      EXPECT_EQ(bodies, n);
      for (const int end : ends) {
        const int s = pieces.ended_by(end);
        EXPECT_EQ(pieces.first(s) + pieces.size(s) - 1, end);
      }
      EXPECT_LE(pieces.length(), 2 * (n / std::min(8, n) + 8)) << n;
    }
}

}  // namespace
}  // namespace linkwise::testing
