// Which joints become the tree, in which order, and which close loops.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/draws.hpp"
#include "linkwise/graph/body_tree.hpp"

namespace linkwise::testing {
namespace {

using Indices = std::vector<int>;
using Joint = MachineGraph::Joint;

MachineGraph graph_of(int n_links, std::vector<Joint> joints) {
  MachineGraph graph;
  graph.massless.assign(n_links, 0);
  graph.joints = std::move(joints);
  return graph;
}

/// Every joint is in the forest or closes a loop, every link hangs on a joint of the forest or is a
/// root.
void check_forest(const MachineGraph& graph, const SpanningForest& forest) {
  std::vector<char> placed(graph.n_links(), 0);
  for (int root : forest.roots) {
    EXPECT_EQ(forest.inboard[root], -1);
    placed[root] = 1;
  }
  for (int j : forest.order) {
    const auto& joint = graph.joints[j];
    EXPECT_EQ(forest.inboard[joint.child], j);
    EXPECT_TRUE(placed[joint.parent]) << "joint " << j << " comes before its parent";
    EXPECT_FALSE(placed[joint.child]) << "joint " << j << " leads back";
    placed[joint.child] = 1;
  }
  EXPECT_EQ(std::count(placed.begin(), placed.end(), 1), graph.n_links());
  EXPECT_EQ(forest.order.size() + forest.loop_joints.size(), graph.joints.size());
  EXPECT_TRUE(std::is_sorted(forest.loop_joints.begin(), forest.loop_joints.end()));
}

TEST(SpanningForest, ATreeIsTakenAsItIsParentsFirst) {
  // ground - 2 - 3, ground - 1; joints of the tips come first.
  const MachineGraph graph = graph_of(4, {{2, 3}, {0, 1}, {0, 2}});
  const SpanningForest forest = make_spanning_forest(graph);
  check_forest(graph, forest);
  EXPECT_EQ(forest.order, (Indices{1, 2, 0}));
  EXPECT_EQ(forest.loop_joints, Indices{});
  EXPECT_EQ(forest.roots, Indices{0});
}

TEST(SpanningForest, AFourBarIsCutWhereItIsCheapest) {
  // ground - crank - coupler, ground - rocker - coupler: a loop through the ground.
  const std::vector<Joint> joints{{0, 1}, {1, 2}, {0, 3}, {3, 2}};
  MachineGraph graph = graph_of(4, joints);
  SpanningForest forest = make_spanning_forest(graph);
  check_forest(graph, forest);
  EXPECT_EQ(forest.order, (Indices{0, 1, 2}));
  EXPECT_EQ(forest.loop_joints, Indices{3});  // all alike: the last one
  EXPECT_EQ(loop_of(graph, forest, 3), (Indices{2, 3, 1, 0}));

  graph.joints[1].freedom = 3;  // fewer loads to find there
  forest = make_spanning_forest(graph);
  check_forest(graph, forest);
  EXPECT_EQ(forest.loop_joints, Indices{1});
  EXPECT_EQ(loop_of(graph, forest, 1), (Indices{0, 1, 3, 2}));

  graph.joints[1].acts = true;  // but not when its coordinates are needed
  forest = make_spanning_forest(graph);
  EXPECT_EQ(forest.loop_joints, Indices{3});

  graph.joints[3].stays = true;  // nor where the other one cannot close a loop
  forest = make_spanning_forest(graph);
  check_forest(graph, forest);
  EXPECT_EQ(forest.loop_joints, Indices{1});
}

TEST(SpanningForest, FixedJointsStayWhateverElseActs) {
  // ground - 1 = 3 (the frame at its other end), ground - 2 - 3.
  MachineGraph graph = graph_of(4, {{0, 1}, {0, 2}, {1, 3, 0, false, true}, {2, 3, 1, true}});
  graph.massless[3] = 1;
  const SpanningForest forest = make_spanning_forest(graph);
  check_forest(graph, forest);
  EXPECT_EQ(forest.loop_joints, Indices{3});
  EXPECT_EQ(make_lumps(graph, forest).lead[3], 1);
}

TEST(SpanningForest, ALoopIsCutFarFromTheGround) {
  // Two legs of two and of three links that meet at link 5, the longer one given first.
  const MachineGraph graph = graph_of(6, {{0, 1}, {1, 2}, {2, 5}, {0, 3}, {3, 5}, {5, 4}});
  const SpanningForest forest = make_spanning_forest(graph);
  check_forest(graph, forest);
  EXPECT_EQ(forest.loop_joints, Indices{2});
  EXPECT_EQ(forest.order, (Indices{0, 1, 3, 4, 5}));
}

TEST(SpanningForest, TwoLoopsThatShareAJointAreCutOnce) {
  // ground - 1 - 2 is in both: 2 - 3 - 5 meets 1 - 4 - 5, and 2 - 6 meets ground - 6.
  const MachineGraph graph =
      graph_of(7, {{0, 1}, {1, 2}, {2, 3}, {3, 5}, {1, 4}, {4, 5}, {2, 6}, {0, 6}});
  const SpanningForest forest = make_spanning_forest(graph);
  check_forest(graph, forest);
  EXPECT_EQ(forest.loop_joints, (Indices{3, 6}));
  EXPECT_EQ(loop_of(graph, forest, 3), (Indices{1, 2, 3, 5, 4}));
  EXPECT_EQ(loop_of(graph, forest, 6), (Indices{0, 1, 6, 7}));
}

TEST(SpanningForest, ALinkThatIsChildOfTwoJointsAtOnce) {
  const MachineGraph graph = graph_of(2, {{0, 1}, {0, 1, 1, true}, {0, 1}});
  const SpanningForest forest = make_spanning_forest(graph);
  check_forest(graph, forest);
  EXPECT_EQ(forest.order, Indices{1});
  EXPECT_EQ(forest.loop_joints, (Indices{0, 2}));
  EXPECT_EQ(loop_of(graph, forest, 0), (Indices{0, 1}));
}

TEST(SpanningForest, ACycleOfDirectedJointsIsCutWhereItLeadsBack) {
  // ground - 1 - 2 - 3 - 1, entered at 1; and one that leads back to the ground.
  const MachineGraph graph = graph_of(4, {{3, 1, 1, true}, {0, 1}, {1, 2}, {2, 3}, {3, 0}});
  const SpanningForest forest = make_spanning_forest(graph);
  check_forest(graph, forest);
  EXPECT_EQ(forest.order, (Indices{1, 2, 3}));
  EXPECT_EQ(forest.loop_joints, (Indices{0, 4}));
  EXPECT_EQ(loop_of(graph, forest, 0), (Indices{2, 3, 0}));
  EXPECT_EQ(loop_of(graph, forest, 4), (Indices{1, 2, 3, 4}));
}

TEST(SpanningForest, WhatTheGroundDoesNotReachGetsRootsOfItsOwn) {
  // 1 - 2 apart, 3 - 4 - 3 in a circle, 5 on itself.
  const MachineGraph graph = graph_of(6, {{1, 2}, {3, 4}, {4, 3}, {5, 5}});
  const SpanningForest forest = make_spanning_forest(graph);
  check_forest(graph, forest);
  EXPECT_EQ(forest.roots, (Indices{0, 1, 3, 5}));
  EXPECT_EQ(forest.loop_joints, (Indices{2, 3}));
  EXPECT_EQ(loop_of(graph, forest, 3), Indices{3});
}

TEST(SpanningForest, RandomGraphsAreCoveredTheSameWayEveryTime) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Draws draws(seed);
    MachineGraph graph = graph_of(2 + draws.below(12), {});
    const int n_joints = draws.below(30);
    for (int j = 0; j < n_joints; ++j)
      graph.joints.push_back({draws.below(graph.n_links()), draws.below(graph.n_links()),
                              draws.below(4), draws.below(2) == 1});
    const SpanningForest forest = make_spanning_forest(graph);
    check_forest(graph, forest);
    const SpanningForest again = make_spanning_forest(graph);
    EXPECT_EQ(forest.order, again.order);
    EXPECT_EQ(forest.loop_joints, again.loop_joints);
  }
}

TEST(BodyTree, WeldedLinksAreOneLumpAndMasslessOnesNoBodies) {
  // ground - 1 = 2 (weld) - 3 (massless) - 4, and 2 - 5.
  MachineGraph graph = graph_of(6, {{0, 1}, {1, 2, 0, false, true}, {2, 3}, {3, 4}, {2, 5}});
  graph.massless[1] = graph.massless[3] = 1;
  const SpanningForest forest = make_spanning_forest(graph);
  const Lumps lumps = make_lumps(graph, forest);
  EXPECT_EQ(lumps.lead, (Indices{0, 1, 1, 3, 4, 5}));
  EXPECT_EQ(lumps.welds, Indices{1});
  EXPECT_EQ(lumps.moving, (Indices{0, 2, 3, 4}));
  EXPECT_FALSE(lumps.massless[1]);  // link 2 gives the lump its mass
  const BodyTree tree = stack_massless(graph, forest, lumps);
  ASSERT_EQ(tree.bodies.size(), 3u);
  EXPECT_EQ(tree.joints, (Indices{0, 1, 2, 3}));
  EXPECT_EQ(tree.bodies[1].link, 4);
  EXPECT_EQ(tree.bodies[1].parent, 0);
  EXPECT_EQ(joints_of(tree, 1).size(), 2u);
  EXPECT_EQ(tree.bodies[2].parent, 0);
}

TEST(BodyTree, AMasslessLinkIsABodyWhereSixDegreesOfFreedomFollow) {
  // ground - 1 - ... - 8 - 9, of which only 9 has mass. From the tip inward 1 + 1 + 3 degrees of
  // freedom end at 6, where 2 more would be 7, and 2 + 1 + 1 + 1 + 1 at 1.
  MachineGraph graph =
      graph_of(10, {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 6, 2}, {6, 7, 3}, {7, 8}, {8, 9}});
  for (int l = 1; l < 9; ++l) graph.massless[l] = 1;
  const SpanningForest forest = make_spanning_forest(graph);
  const BodyTree tree = stack_massless(graph, forest, make_lumps(graph, forest));
  ASSERT_EQ(tree.bodies.size(), 3u);
  for (int b = 0; b < 3; ++b) {
    EXPECT_EQ(tree.bodies[b].link, (Indices{1, 6, 9})[b]);
    EXPECT_EQ(tree.bodies[b].parent, b - 1);
    EXPECT_EQ(joints_of(tree, b).size(), (std::vector<size_t>{1, 5, 3})[b]);
  }
}

TEST(BodyTree, AMasslessLinkWithTheEndOfALoopStaysABody) {
  // ground - 1 (massless) - 2, and a loop joint between 1 and 3, which hangs on the ground.
  MachineGraph graph = graph_of(4, {{0, 1, 1, true}, {1, 2, 1, true}, {0, 3, 1, true}, {1, 3}});
  graph.massless[1] = 1;
  const SpanningForest forest = make_spanning_forest(graph);
  EXPECT_EQ(forest.loop_joints, Indices{3});
  const Lumps lumps = make_lumps(graph, forest);
  EXPECT_FALSE(lumps.stacked[1]);
  EXPECT_EQ(stack_massless(graph, forest, lumps).bodies.size(), 3u);
}

}  // namespace
}  // namespace linkwise::testing
