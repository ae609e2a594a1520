// Large trees cut at their branches, the branches shared by threads.

#include <algorithm>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/dynamics/articulated_body.hpp"

namespace linkwise::testing {
namespace {

/// `arms` chains of `length` on a trunk of as many bodies, or on the ground; numbered arm by arm,
/// or all first links before all second ones.
std::vector<int> comb(int arms, int length, bool trunk, bool in_layers) {
  std::vector<int> parents;
  if (trunk)
    for (int i = 0; i < arms; ++i) parents.push_back(i - 1);
  const int base = static_cast<int>(parents.size());
  for (int k = 0; k < arms * length; ++k) {
    const int arm = in_layers ? k % arms : k / length, link = in_layers ? k / arms : k % length;
    const int before = in_layers ? base + k - arms : base + k - 1;
    parents.push_back(link > 0 ? before : trunk ? arm : -1);
  }
  return parents;
}

struct Tree {
  std::string name;
  std::vector<int> parents;
};
std::vector<Tree> trees() {
  Draws draws(5);
  return {{"arm_by_arm", comb(12, 60, true, false)},
          {"in_layers", comb(12, 60, true, true)},
          {"on_the_ground", comb(9, 50, false, false)},
          {"random", random_parents(900, draws)}};
}

Model model_of(const Tree& tree) {
  const JointType kinds[] = {JointType::revolute,  JointType::revolute, JointType::prismatic,
                             JointType::spherical, JointType::revolute, JointType::universal};
  std::vector<JointType> types;
  for (size_t i = 0; i < tree.parents.size(); ++i) types.push_back(kinds[i % std::size(kinds)]);
  Draws draws(6);
  return Model(tree_spec(types, tree.parents, draws));
}

class BranchThreads : public ::testing::TestWithParam<Tree> {};

TEST_P(BranchThreads, SameBitsAndTheUncutRecursion) {
  const Model model = model_of(GetParam());
  const Branches branches(model);
  EXPECT_GE(branches.shares.size(), 2u);
  const DynamicsCase c(model, 9);
  const auto run = [&](int threads) {
    ArticulatedBody<double> method(model);
    if (threads > 0) method.share_branches(Executor(threads));
    Motion6 out{std::vector<double>(model.nv()), std::vector<double>(6 * model.n_joints())};
    std::vector<double> without_loads(model.nv());
    EXPECT_TRUE(method.evaluate(c.input(), out.du.data(), out.loads.data()));
    EXPECT_TRUE(method.evaluate(c.input(), without_loads.data(), nullptr));
    expect_close(without_loads, out.du, 1e-13, "without loads");
    return out;
  };
  const Motion6 uncut = run(0), one = run(1);
  expect_close(one.du, uncut.du, 1e-10, "accelerations");
  expect_close(one.loads, uncut.loads, 1e-10, "loads");
  for (const int threads : {2, 3, 7}) {
    const Motion6 several = run(threads);
    EXPECT_EQ(several.du, one.du) << threads << " threads";
    EXPECT_EQ(several.loads, one.loads) << threads << " threads";
  }
}

TEST_P(BranchThreads, EveryBodyIsInOneShareOrTheTrunk) {
  const Model model = model_of(GetParam());
  const Branches branches(model);
  std::vector<int> where(model.n_bodies(), -1);  // share, or one beyond them: the trunk
  const int trunk = static_cast<int>(branches.shares.size());
  const auto enter = [&](const std::vector<linkwise::KindRange>& ranges, int place) {
    for (const linkwise::KindRange& range : ranges)
      for (int n = range.begin; n < range.end; ++n) {
        EXPECT_EQ(where[n], -1);
        EXPECT_EQ(model.topology[n].joint_kind, range.joint_kind);
        where[n] = place;
      }
  };
  enter(branches.trunk, trunk);
  for (int i = 0; i < trunk; ++i) enter(branches.shares[i].kind_ranges, i);
  for (int n = 0; n < model.n_bodies(); ++n) {
    ASSERT_GE(where[n], 0);
    if (where[n] == trunk) continue;
    const auto& roots = branches.shares[where[n]].roots;
    const bool root = std::binary_search(roots.begin(), roots.end(), n);
    const int parent = model.topology[n].parent;
    EXPECT_EQ(root, parent < 0 || where[parent] == trunk);
    if (!root) EXPECT_EQ(where[parent], where[n]);
  }
}

INSTANTIATE_TEST_SUITE_P(Trees, BranchThreads, ::testing::ValuesIn(trees()),
                         [](const auto& test) { return test.param.name; });

// What would have to be done one after the other stays the recursion as it is.
TEST(Branches, ChainsAndSmallTreesAreNotCut) {
  EXPECT_TRUE(Branches(model_of({"chain", chain_parents(3000)})).shares.empty());
  EXPECT_TRUE(Branches(model_of({"small", comb(4, 10, true, false)})).shares.empty());
}

}  // namespace
}  // namespace linkwise::testing
