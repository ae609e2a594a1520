// Which loads are determinate, on machines whose answer is known, and self-stresses of random ones.
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "dynamics/looped_machine.hpp"
#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/dynamics/indeterminacy.hpp"

namespace linkwise::testing {
namespace {

struct Hinge {
  const char *name, *parent, *child;
  Vec3<double> point, axis;
};

/// A rod of one kilogram from the origin of its frame, which is parallel to the world's.
LinkSpec rod(const char* name, const Vec3<double>& along) {
  LinkSpec link;
  link.name = name;
  link.mass = 1;
  link.com = 0.5 * along;
  const double square = dot(along, along) / 12, thick = 0.01 / 6;
  link.inertia.m[0] = square - along.x * along.x / 12 + thick;
  link.inertia.m[1] = -along.x * along.y / 12;
  link.inertia.m[2] = square - along.y * along.y / 12 + thick;
  link.inertia.m[3] = -along.x * along.z / 12;
  link.inertia.m[4] = -along.y * along.z / 12;
  link.inertia.m[5] = square - along.z * along.z / 12 + thick;
  return link;
}

/// Rods from origins in the world, hinges at points of the world; the hinge `cut` closes the loop.
Model linkage(const std::vector<std::pair<LinkSpec, Vec3<double>>>& rods,
              const std::vector<Hinge>& hinges, const std::string& cut, JointType cut_type) {
  ModelSpec spec;
  spec.links.push_back({"base", 0, {}, {}});
  for (const auto& [link, origin] : rods) spec.links.push_back(link);
  const auto origin_of = [&](const std::string& name) {
    for (const auto& [link, origin] : rods)
      if (link.name == name) return origin;
    return Vec3<double>{};
  };
  // A joint's point is its child's origin: the frame of a tree's child is put there.
  std::vector<Vec3<double>> origins(spec.links.size());
  for (const Hinge& h : hinges) {
    JointSpec joint;
    joint.name = h.name;
    joint.parent = h.parent;
    joint.child = h.child;
    joint.axes = {{AxisKind::revolute, h.axis, 0}};
    joint.translation = h.point - origin_of(h.parent);
    if (h.name == cut) {
      joint.type = cut_type;
      LoopJointSpec loop;
      loop.joint = joint;
      loop.child_translation = h.point - origin_of(h.child);
      spec.loop_joints.push_back(loop);
    } else {
      joint.type = JointType::revolute;
      spec.joints.push_back(joint);
    }
  }
  return Model(spec);
}

std::string mask(const Indeterminacy& found, int row) {
  std::string text;
  for (int i = 0; i < 6; ++i) text += found.determinate[6 * row + i] ? '1' : '0';
  return text;
}

Model four_bar(JointType cut_type) {
  return linkage({{rod("crank", {0, 1, 0}), {0, 0, 0}},
                  {rod("coupler", {1, 0, 0}), {0, 1, 0}},
                  {rod("rocker", {0, 1, 0}), {1, 0, 0}}},
                 {{"a", "base", "crank", {0, 0, 0}, {0, 0, 1}},
                  {"b", "crank", "coupler", {0, 1, 0}, {0, 0, 1}},
                  {"d", "base", "rocker", {1, 0, 0}, {0, 0, 1}},
                  {"c", "coupler", "rocker", {1, 1, 0}, {0, 0, 1}}},
                 "c", cut_type);
}

TEST(Indeterminacy, PlanarFourBarKnowsItsForcesInThePlane) {
  const Model model = four_bar(JointType::revolute);
  const Indeterminacy found = find_indeterminacy(model, model.neutral_configuration().data());
  EXPECT_EQ(found.rows, 5);
  EXPECT_EQ(found.rank, 2);
  EXPECT_EQ(found.mobility, 1);
  for (int row = 0; row < 4; ++row) EXPECT_EQ(mask(found, row), "110001") << row;
}

// A ball or a ball on a slide takes the repetition out.
TEST(Indeterminacy, AFourBarOfBallsKnowsMore) {
  const Model model = four_bar(JointType::spherical);
  const Indeterminacy found = find_indeterminacy(model, model.neutral_configuration().data());
  EXPECT_EQ(found.rows, 3);
  EXPECT_EQ(found.rank, 2);
  EXPECT_EQ(found.n_self_stresses, 1);
  EXPECT_EQ(mask(found, 3), "110111");  // fz alone is open at the ball
}

TEST(Indeterminacy, BricardsLoopKnowsNoComponent) {
  const Vec3<double> P[6] = {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}};
  const char* rods[6] = {"r0", "r1", "r2", "r3", "r4", "base"};
  const char* names[6] = {"h0", "h1", "h2", "h3", "h4", "h5"};
  std::vector<std::pair<LinkSpec, Vec3<double>>> links;
  std::vector<Hinge> hinges;
  for (int i = 0; i < 6; ++i) {
    const Vec3<double> before = P[i] - P[(i + 5) % 6], after = P[(i + 1) % 6] - P[i];
    if (i < 5) links.push_back({rod(rods[i], after), P[i]});
    if (i < 5)
      hinges.push_back(
          {names[i], i == 0 ? "base" : rods[i - 1], rods[i], P[i], cross(before, after)});
    else
      hinges.push_back({names[i], "base", rods[4], P[i], cross(before, after)});
  }
  const Model model = linkage(links, hinges, "h5", JointType::revolute);
  const Indeterminacy found = find_indeterminacy(model, model.neutral_configuration().data());
  EXPECT_EQ(found.rows, 5);
  EXPECT_EQ(found.rank, 4);
  EXPECT_EQ(found.mobility, 1);
  // All that the hinges hold is open; about the axis they hold nothing.
  for (int row = 0; row < 6; ++row)
    EXPECT_EQ(std::count(&found.determinate[6 * row], &found.determinate[6 * row] + 6, 1), 1);
}

// A door on two hinges: five self-stresses, so that only sums are known.
TEST(Indeterminacy, ADoorOnTwoHinges) {
  const Model model = linkage({{rod("door", {1, 0, 0.5}), {0, 0, 0}}},
                              {{"low", "base", "door", {0, 0, 0}, {0, 0, 1}},
                               {"high", "base", "door", {0, 0, 2}, {0, 0, 1}}},
                              "high", JointType::revolute);
  const Indeterminacy found = find_indeterminacy(model, model.neutral_configuration().data());
  EXPECT_EQ(found.rows, 5);
  EXPECT_EQ(found.rank, 0);
  EXPECT_EQ(found.mobility, 1);
  for (int row = 0; row < 2; ++row) EXPECT_EQ(mask(found, row), "000001");
  // The hinges' shares cancel: same forces, moments about one point.
  for (int k = 0; k < 5; ++k) {
    const double *low = &found.self_stresses[12 * k], *high = low + 6;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(low[i] + high[i], 0, 1e-14);
    EXPECT_NEAR(low[3] + high[3] - 2 * high[1], 0, 1e-14);
    EXPECT_NEAR(low[4] + high[4] + 2 * high[0], 0, 1e-14);
  }
}

// What gears in a ring put into a wheel cancels there, whatever the sizes: rounding is no load.
TEST(Indeterminacy, GearsInARingLoadNoJoint) {
  for (const double scale : {1.0, 1e-7, 1e7}) {
    SCOPED_TRACE(scale);
    ModelSpec spec;
    spec.links.push_back({"base", 0, {}, {}});
    for (int k = 0; k < 3; ++k) {
      spec.links.push_back(rod(k == 0 ? "a" : k == 1 ? "b" : "c", {1, 0.3 * k, 0.1}));
      JointSpec joint;
      joint.name = "hinge_" + spec.links.back().name;
      joint.parent = "base";
      joint.child = spec.links.back().name;
      joint.axes = {{AxisKind::revolute, {0, 0, 1}, 0}};
      joint.translation = {0.7 * k, 0, 0};
      spec.joints.push_back(joint);
    }
    spec.couplings = {{"ab", {{"hinge_a", scale}, {"hinge_b", scale / 3}}, 0},
                      {"bc", {{"hinge_b", 0.7}, {"hinge_c", 1}}, 0},
                      {"ca", {{"hinge_a", 2.1}, {"hinge_c", -1}}, 0}};
    const Model model(spec);
    const std::vector<double> q(3);
    const Indeterminacy found = find_indeterminacy(model, q.data());
    EXPECT_EQ(found.n_self_stresses, 1);
    EXPECT_EQ(found.mobility, 1);
    for (int j = 0; j < 3; ++j) EXPECT_EQ(mask(found, j), "111111");
    for (const char known : found.couplings) EXPECT_FALSE(known);
  }
}

// A self-stress, added to the loads, leaves Newton and Euler as they are.
TEST(Indeterminacy, SelfStressesOfRandomMachinesCancel) {
  int seen = 0;
  for (int sample = 0; sample < 30; ++sample) {
    SCOPED_TRACE(sample);
    Draws draws(500 + sample);
    const int n = 4 + draws.below(8);
    ModelSpec spec = tree_spec(random_types(n, draws), random_parents(n, draws), draws);
    spec.floating_base = sample % 2 == 0;
    LoopedMachine machine(spec, draws);
    const int bodies = machine.tree.n_bodies();
    if (bodies < 3) continue;
    for (int l = 0; l < 2; ++l) {
      const int a = draws.below(bodies);
      machine.close(JointType::revolute, a - 1, a == bodies - 1 ? 0 : a, draws);
      machine.close_again();
    }
    const Indeterminacy found = find_indeterminacy(machine.model, machine.q.data());
    seen += found.n_self_stresses;
    EXPECT_EQ(found.rank, machine.make_consistent());
    const WorldTwin twin(machine.tree);
    const std::vector<double> rest(machine.tree.nv());
    for (int k = 0; k < found.n_self_stresses; ++k) {
      const double* stress = &found.self_stresses[6 * machine.model.n_loads() * k];
      LoopStates states(machine.model);
      states.update(machine.input());
      std::vector<double> external(6 * machine.tree.n_joints());
      for (int l = 0; l < machine.model.n_loops(); ++l) {
        const LoopJoint& loop = machine.model.loops.joints[l];
        const Force<double> w = transpose_times(
            loop.joint.to_user, to_force(stress + 6 * (machine.tree.n_joints() + l)));
        machine.push(loop.joint.body, wrench_on_b(loop, w), external);
        machine.push(loop.parent_body, wrench_on_a(states[l], w), external);
      }
      const auto want = twin.inverse_dynamics(machine.q, rest, rest, external, 0);
      for (const double tau : want.tau) EXPECT_NEAR(tau, 0, 1e-8);
      for (size_t i = 0; i < want.loads.size(); ++i) EXPECT_NEAR(stress[i], want.loads[i], 1e-8);
    }
  }
  EXPECT_GT(seen, 100);
}

}  // namespace
}  // namespace linkwise::testing
