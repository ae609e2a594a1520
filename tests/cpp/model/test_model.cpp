// What a model makes of its links and joints: merging, stacking, order, layout, size.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/base/error.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

/// "level element: text" of every note.
std::vector<std::string> notes_of(const Model& model) {
  const char* levels[] = {"merge", "warning", "info"};
  std::vector<std::string> out;
  for (const Note& n : model.notes)
    out.push_back(std::string(levels[static_cast<int>(n.level)]) + " " + n.element + ": " + n.text);
  return out;
}
std::vector<std::string> joint_names(const Model& model) {
  std::vector<std::string> out;
  for (const JointInfo& j : model.joints) out.push_back(j.name);
  return out;
}
using Names = std::vector<std::string>;

TEST(LightLinks, FixedLinksMergeIntoTheirParents) {
  Draws draws(1);
  const ModelSpec spec = tree_spec({fixed, revolute, fixed, fixed}, {-1, 0, 1, 2}, draws);
  const Model model(spec);
  EXPECT_EQ(joint_names(model), Names{"joint1"});
  EXPECT_EQ(notes_of(model), (Names{"merge link0: welded to 'base' by fixed joint 'joint0'",
                                    "merge link2: welded to 'link1' by fixed joint 'joint2'",
                                    "merge link3: welded to 'link1' by fixed joint 'joint3'"}));
  EXPECT_EQ(model.links[1].joint, -1);
  for (int l : {2, 3, 4}) EXPECT_EQ(model.links[l].joint, 0);
  // The ground is no part of what moves.
  const double moving = spec.links[2].mass + spec.links[3].mass + spec.links[4].mass;
  EXPECT_DOUBLE_EQ(model.total_mass(), moving);
  EXPECT_DOUBLE_EQ(mass(model.constants[0].rigid), moving);
  ModelSpec floating = spec;
  floating.floating_base = true;
  EXPECT_NEAR(Model(floating).total_mass(), moving + spec.links[0].mass + spec.links[1].mass,
              1e-14);
}

TEST(LightLinks, FixedJointsAreKeptOnRequestWhereTheyCarryMass) {
  Draws draws(2);
  ModelSpec spec = tree_spec({fixed, revolute, fixed, fixed}, {-1, 0, 1, 2}, draws);
  make_massless(spec.links[4]);
  spec.keep_fixed = true;
  const Model model(spec);
  EXPECT_EQ(joint_names(model), (Names{"joint0", "joint1", "joint2"}));
  EXPECT_EQ(model.nv(), 1);
  EXPECT_EQ(notes_of(model), Names{"merge link3: welded to 'link2' by fixed joint 'joint3'"});
}

TEST(LightLinks, MasslessLinksBetweenBodiesStackTheirJoints) {
  Draws draws(3);
  ModelSpec spec = tree_spec({revolute, prismatic, universal, revolute}, {-1, 0, 1, 2}, draws);
  make_massless(spec.links[1]);
  make_massless(spec.links[2]);
  const Model model(spec);
  ASSERT_EQ(model.n_bodies(), 2);
  ASSERT_EQ(model.n_joints(), 4);
  EXPECT_EQ(model.topology[0].n_elements, 4);
  EXPECT_EQ(model.topology[0].joint_kind, JointKind::general);
  EXPECT_EQ(model.body_name(0), "link2");
  EXPECT_EQ(notes_of(model),
            (Names{"merge link0: has no mass: joint 'joint0' is stacked with 'joint1'",
                   "merge link1: has no mass: joint 'joint1' is stacked with 'joint2'"}));
  for (int j = 0; j < 4; ++j) EXPECT_EQ(model.joints[j].last_of_body, j >= 2);
  EXPECT_EQ(model.singular_body(), -1);
}

TEST(LightLinks, SixDegreesOfFreedomStackSevenDoNot) {
  Draws draws(4);
  ModelSpec spec = tree_spec({spherical, planar}, {-1, 0}, draws);
  make_massless(spec.links[1]);
  EXPECT_EQ(Model(spec).topology[0].nv, 6);
  EXPECT_EQ(Model(spec).undetermined(), "");
  spec.joints.back().type = floating;
  const Model model(spec);
  EXPECT_EQ(model.n_bodies(), 2);
  EXPECT_EQ(model.body_name(model.singular_body()), "link0");
  EXPECT_EQ(model.undetermined(),
            "link 'link0' has no mass or no inertia where joints 'joint0', 'joint1' can move it "
            "(more than 6 degrees of freedom in a row), so accelerations are not determined; give "
            "mass and inertia (with_link, or [link.\"link0\"] in a scenario), or make the joint "
            "fixed, lock it, or give it armature");
  EXPECT_EQ(notes_of(model),
            (Names{"info link0: has no mass and joints on both sides with more than 6 degrees "
                   "of freedom; method constraint_force cannot take it, articulated_body can",
                   "warning link0: links 'link0' have no mass, and joints 'joint0', 'joint1' leave "
                   "'link1' 9 degrees of freedom without armature, 6 at most are determined"}));
  spec.joints[0].dof = {{DofProperty::armature, {0.1}}};
  EXPECT_EQ(Model(spec).undetermined(), "");
  spec.joints[0].dof = {};
  spec.prescribed = {"joint0"};
  EXPECT_EQ(Model(spec).undetermined(), "");
}

TEST(LightLinks, AMasslessHubIsForTheRecursionOnly) {
  Draws draws(5);
  ModelSpec spec = tree_spec({revolute, revolute, spherical}, {-1, 0, 0}, draws);
  make_massless(spec.links[1]);
  const Model model(spec);
  EXPECT_EQ(notes_of(model),
            Names{"info link0: has no mass and carries several joints; method constraint_force "
                  "cannot take it, articulated_body can"});
  EXPECT_EQ(model.singular_body(), 0);
  EXPECT_EQ(model.body_name(model.singular_body()), "link0");
}

TEST(LightLinks, DoubtfulInertiasAreWarnedAbout) {
  struct Case {
    double mass;
    Sym3<double> inertia;
    Names notes;
  };
  const Case cases[] = {
      {1, {{1, 0, 1, 0, 0, 1}}, {}},
      {1, {{1, 0, 1, 0, 0, 2}}, {}},
      {1, {}, {"warning tip: a principal moment of inertia is zero"}},
      {1, {{1, 0, 1, 0, 0, 0}}, {"warning tip: a principal moment of inertia is zero"}},
      {1,
       {{1, 0, 1, 0, 0, 2.1}},
       {"warning tip: principal moments of inertia break the triangle inequality: no real body has "
        "them"}},
      {0, {{1, 0, 1, 0, 0, 1}}, {"warning tip: has rotational inertia but no mass"}},
  };
  for (const Case& c : cases) {
    Draws draws(6);
    for (double size : {1e-9, 1.0, 1e9})
      for (int turn = 0; turn < 20; ++turn) {  // in whatever axes the inertia is given
        ModelSpec spec;
        spec.links = {{"base", 0, {}, {}}, {"tip", c.mass, {0.3, 0, 0}, c.inertia}};
        Sym3<double>& inertia = spec.links[1].inertia;
        if (turn > 0) inertia = congruence(random_rotation(draws), inertia);
        for (double& x : inertia.m) x *= size;
        spec.joints = {random_joint(revolute, "hinge", "base", "tip", draws)};
        EXPECT_EQ(notes_of(Model(spec)), c.notes);
      }
  }
}

TEST(Order, JointsComeParentsFirstAndAsInTheFileOtherwise) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Draws draws(seed);
    const int n = 12;
    ModelSpec spec = tree_spec(std::vector(n, revolute), random_parents(n, draws), draws);
    for (size_t i = spec.joints.size(); i-- > 1;)
      std::swap(spec.joints[i], spec.joints[draws.below(static_cast<int>(i) + 1)]);
    // Obvious twin: again and again the first joint of the file whose parent is there.
    Names want;
    std::set<std::string> there{"base"};
    std::vector<char> done(n, 0);
    while (static_cast<int>(want.size()) < n)
      for (int j = 0; j < n; ++j)
        if (!done[j] && there.count(spec.joints[j].parent)) {
          done[j] = 1;
          there.insert(spec.joints[j].child);
          want.push_back(spec.joints[j].name);
          break;
        }
    const Model model(spec);
    EXPECT_EQ(joint_names(model), want);
    int q = 0;
    for (const JointInfo& j : model.joints) EXPECT_EQ(j.q, q++);
    for (int b = 0; b < model.n_bodies(); ++b) EXPECT_LT(model.topology[b].parent, b);
  }
}

TEST(Layout, CoordinatesFollowTheJoints) {
  Draws draws(7);
  const JointType types[] = {floating,  revolute,  spherical, planar,     universal,
                             composite, prismatic, helical,   cylindrical};
  const int nq[] = {7, 1, 4, 3, 2, 3, 1, 1, 2}, nv[] = {6, 1, 3, 3, 2, 3, 1, 1, 2};
  const Model model(tree_spec({std::begin(types), std::end(types)}, chain_parents(9), draws));
  int q = 0, v = 0;
  for (int j = 0; j < 9; ++j) {
    const JointInfo& info = model.joints[j];
    EXPECT_EQ(info.q, q);
    EXPECT_EQ(info.v, v);
    EXPECT_EQ(info.nq, nq[j]);
    EXPECT_EQ(info.nv, nv[j]);
    q += nq[j];
    v += nv[j];
  }
  EXPECT_EQ(model.nq(), q);
  EXPECT_EQ(model.nv(), v);
  std::vector<double> neutral(q, 0.0);
  neutral[6] = neutral[11] = 1;  // w of the floating and of the spherical joint
  EXPECT_EQ(model.neutral_configuration(), neutral);
}

TEST(Layout, PropertiesAreOnePerDegreeOfFreedom) {
  Draws draws(8);
  ModelSpec spec = tree_spec({revolute, planar}, {-1, 0}, draws);
  spec.joints[0].dof = {{DofProperty::lower, {-2}}, {DofProperty::damping, {0.5}}};
  spec.joints[1].dof = {{DofProperty::damping, {3}}, {DofProperty::upper, {1, 2, 3}}};
  const Model model(spec);
  using Values = std::vector<double>;
  EXPECT_EQ(model.dof_values(DofProperty::damping), (Values{0.5, 3, 3, 3}));
  EXPECT_EQ(model.dof_values(DofProperty::lower), (Values{-2, -infinity, -infinity, -infinity}));
  EXPECT_EQ(model.dof_values(DofProperty::upper), (Values{infinity, 1, 2, 3}));
  EXPECT_EQ(model.dof_values(DofProperty::friction_velocity), Values(4, 0.01));
  EXPECT_TRUE(model.has_passive_forces());
}

TEST(Size, AHundredThousandLinksNeedNoStack) {
  const int n = 100'000;
  for (JointType type : {revolute, fixed})
    for (bool tip_first : {false, true}) {
      Draws draws(9);
      ModelSpec spec = tree_spec(std::vector(n, type), chain_parents(n), draws);
      if (tip_first) std::reverse(spec.joints.begin(), spec.joints.end());
      const Model model(std::move(spec));
      EXPECT_EQ(model.n_bodies(), type == revolute ? n : 0);
      EXPECT_EQ(model.n_joints(), model.n_bodies());
      if (type == revolute) {
        EXPECT_EQ(model.topology[n - 1].parent, n - 2);
      }
      EXPECT_EQ(model.links[n].joint, type == revolute ? n - 1 : -1);
    }
  Draws draws(10);
  std::vector<int> parents(n, 0);
  parents[0] = -1;
  EXPECT_EQ(Model(tree_spec(std::vector(n, revolute), parents, draws)).topology[0].n_children,
            n - 1);
}

}  // namespace
}  // namespace linkwise::testing
