// Trees whose paths run side by side in SIMD lanes, against the recursion body by body.

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/articulated_paths.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

struct Tree {
  std::string name;
  std::vector<JointType> types;
  std::vector<int> parents;
};

Tree revolute_tree(std::string name, std::vector<int> parents) {
  return {std::move(name), std::vector<JointType>(parents.size(), revolute), std::move(parents)};
}

/// `count` legs of `length` on body `on`, the last joint of each of the given type.
void add_legs(Tree& tree, int count, int length, int on, JointType last = revolute) {
  for (int leg = 0; leg < count; ++leg)
    for (int k = 0; k < length; ++k) {
      tree.parents.push_back(k == 0 ? on : static_cast<int>(tree.parents.size()) - 1);
      tree.types.push_back(k + 1 < length ? revolute : last);
    }
}

/// Parents at most `reach` bodies before: long paths that branch everywhere.
std::vector<int> bushy_parents(int n, int reach, Draws& draws) {
  std::vector<int> parents(n);
  for (int i = 0; i < n; ++i) parents[i] = i == 0 ? -1 : i - 1 - draws.below(std::min(i, reach));
  return parents;
}

std::vector<Tree> trees() {
  Draws draws(3);
  std::vector<Tree> all;
  for (const int n : {1, 2, 5, 13, 30, 61, 200, 900})
    all.push_back(revolute_tree("random" + std::to_string(n), random_parents(n, draws)));
  for (const int n : {9, 50, 333})
    all.push_back(revolute_tree("bushy" + std::to_string(n), bushy_parents(n, 3, draws)));
  all.push_back(revolute_tree("chain", chain_parents(11)));
  std::vector<int> binary(127);
  for (int i = 0; i < 127; ++i) binary[i] = (i + 1) / 2 - 1;
  all.push_back(revolute_tree("binary", binary));

  Tree quadruped{"quadruped", {floating}, {-1}};
  add_legs(quadruped, 4, 3, 0);
  all.push_back(quadruped);
  Tree humanoid{"humanoid", {floating, revolute, revolute}, {-1, 0, 1}};
  add_legs(humanoid, 2, 6, 0);
  add_legs(humanoid, 2, 7, 2);
  add_legs(humanoid, 1, 2, 2);
  all.push_back(humanoid);
  Tree grippers{"grippers", {prismatic, prismatic}, {-1, 0}};
  add_legs(grippers, 3, 5, 1, prismatic);
  add_legs(grippers, 2, 4, 1, spherical);
  add_legs(grippers, 3, 4, 1);
  for (const int on : {6, 6, 11, 20, 24, 27}) add_legs(grippers, 2, 2, on, universal);
  all.push_back(grippers);
  Tree mixed{"mixed", {}, random_parents(150, draws)};
  for (size_t i = 0; i < mixed.parents.size(); ++i)
    mixed.types.push_back(draws.below(4) > 0 ? revolute : random_types(1, draws)[0]);
  all.push_back(mixed);
  Tree sliding{"no_paths", {}, random_parents(12, draws)};
  sliding.types.assign(12, prismatic);
  all.push_back(sliding);
  return all;
}

Model model_of(const Tree& tree, bool floating_base = false) {
  Draws draws(8);
  ModelSpec spec = tree_spec(tree.types, tree.parents, draws);
  spec.floating_base = floating_base;
  return Model(spec);
}

class PathThreads : public ::testing::TestWithParam<Tree> {};

template <class Method>
Motion6 run(Method& method, const Model& model, const SweepInput<double>& in) {
  Motion6 out{std::vector<double>(model.nv(), NAN), std::vector<double>(6 * model.n_joints(), NAN)};
  EXPECT_TRUE(method.evaluate(in, out.du.data(), out.loads.data()));
  return out;
}

template <int width>
void expect_same(const Model& model) {
  SCOPED_TRACE(std::to_string(width) + " lanes");
  ArticulatedBody<double> body_by_body(model);
  ArticulatedPaths<Lanes<width>> paths(model);
  for (const int seed : {1, 2}) {
    const DynamicsCase c(model, seed);
    SweepInput<double> bare = c.input();
    bare.external = nullptr;
    bare.v = nullptr;
    bare.gravity_factor = 0.5;
    for (const SweepInput<double>& in : {c.input(), bare}) {
      const Motion6 want = run(body_by_body, model, in), got = run(paths, model, in);
      expect_close(got.du, want.du, 1e-11, "accelerations");
      expect_close(got.loads, want.loads, 1e-11, "loads");
      std::vector<double> without_loads(model.nv(), NAN);
      EXPECT_TRUE(paths.evaluate(in, without_loads.data(), nullptr));
      expect_close(without_loads, got.du, 1e-13, "without loads");
    }
  }
}

TEST_P(PathThreads, AsBodyByBody) {
  for (const bool floating_base : {false, true}) {
    const Model model = model_of(GetParam(), floating_base);
    expect_same<2>(model);
    expect_same<4>(model);
    expect_same<8>(model);
  }
}

TEST_P(PathThreads, SameBits) {
  const Model model = model_of(GetParam());
  const DynamicsCase c(model, 4);
  ArticulatedPaths<Lanes<2>> one(model, Executor(1));
  const Motion6 want = run(one, model, c.input());
  for (const int threads : {2, 3, 7}) {
    ArticulatedPaths<Lanes<2>> several(model, Executor(threads));
    const Motion6 got = run(several, model, c.input());
    EXPECT_EQ(got.du, want.du) << threads << " threads";
    EXPECT_EQ(got.loads, want.loads) << threads << " threads";
  }
}

TEST_P(PathThreads, EveryBodyIsOnOnePathOrNone) {
  const Model model = model_of(GetParam());
  const Paths paths(model);
  std::vector<int> met(model.n_bodies(), 0);
  for (const auto* ranges : {&paths.trunk, &paths.outer})
    for (const linkwise::KindRange& r : *ranges)
      for (int n = r.begin; n < r.end; ++n) ++met[n];
  for (size_t i = 0; i < paths.path.size(); ++i) {
    const auto& path = paths.path[i];
    if (i > 0) EXPECT_GE(path.length, paths.path[i - 1].length);
    for (int k = 0; k < path.length; ++k) {
      const int n = paths.body_at(static_cast<int>(i), k);
      ++met[n];
      EXPECT_EQ(model.topology[n].parent,
                k + 1 < path.length ? paths.body_at(static_cast<int>(i), k + 1) : path.parent);
    }
  }
  EXPECT_EQ(std::count(met.begin(), met.end(), 1), model.n_bodies());
}

INSTANTIATE_TEST_SUITE_P(Trees, PathThreads, ::testing::ValuesIn(trees()),
                         [](const auto& test) { return test.param.name; });

TEST(Paths, FillLanesOfRobotsWithLegsButNotOfChains) {
  Tree quadruped{"quadruped", {floating}, {-1}};
  add_legs(quadruped, 4, 3, 0);
  EXPECT_TRUE(paths_fill(model_of(quadruped), 4));
  EXPECT_FALSE(paths_fill(model_of(revolute_tree("chain", chain_parents(40))), 4));
  Tree lopsided = revolute_tree("lopsided", chain_parents(60));
  add_legs(lopsided, 3, 2, 30);
  EXPECT_FALSE(paths_fill(model_of(lopsided), 4));
  Tree twigs{"twigs", {prismatic}, {-1}};
  add_legs(twigs, 5, 1, 0);
  EXPECT_FALSE(paths_fill(model_of(twigs), 4));
}

TEST(Paths, TheMethodOfATreeIsTheOneOnPaths) {
  Tree arms = revolute_tree("arms", {});
  add_legs(arms, 8, 10, -1);
  const Model model = model_of(arms);
  ASSERT_TRUE(paths_fill(model, native_lanes));
  const DynamicsCase c(model, 5);
  ArticulatedPaths<Lanes<native_lanes>> paths(model);
  const Motion6 want = run(paths, model, c.input());
  const Motion6 got = evaluate(*make_dynamics(model, {}), model, c.input());
  EXPECT_EQ(got.du, want.du);
  EXPECT_EQ(got.loads, want.loads);
}

// The innermost failure would be that of a body which others hang on; the outermost is named.
TEST(Paths, NamesTheBodyWhosePivotFails) {
  Tree tree = revolute_tree("legs", {});
  add_legs(tree, 4, 3, -1);
  Draws draws(8);
  ModelSpec spec = tree_spec(tree.types, tree.parents, draws);
  Model model(spec);
  model.constants[7].rigid.inertia.I = {{-1e3, 0, -1e3, 0, 0, -1e3}};
  ArticulatedPaths<Lanes<4>> paths(model);
  ArticulatedBody<double> body_by_body(model);
  const DynamicsCase c(model, 5);
  std::vector<double> du(model.nv());
  EXPECT_FALSE(paths.evaluate(c.input(), du.data(), nullptr));
  EXPECT_FALSE(body_by_body.evaluate(c.input(), du.data(), nullptr));
  EXPECT_EQ(paths.failed_body(), body_by_body.failed_body());
}

}  // namespace
}  // namespace linkwise::testing
