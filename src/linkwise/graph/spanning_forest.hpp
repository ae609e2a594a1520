#pragma once
// The tree that the recursion runs over, and the joints that close loops in it. The same division
// as in Drake's multibody topology (LinkJointGraph and SpanningForest), but a joint is never turned
// round: its coordinates and its load stay those of its child against its parent.
//
// A link that is the child of several joints hangs on one of them; the others are loop joints.
// Joints that are given as such are loop joints in any case. The others are chosen in this order:
//     those that can close a loop
//     those that are not fixed: the frame at the other end of a link stays on it
//     those that do not act along their coordinates
//     those with more freedom: fewer loads to find
//     those whose parent is further from the ground: short loops
//     those that come later in the file
#include <vector>

#include "linkwise/graph/machine_graph.hpp"

namespace linkwise {

struct SpanningForest {
  std::vector<int> roots;        ///< the ground, then links that no joint path from it reaches
  std::vector<int> inboard;      ///< by link: the joint that it hangs on, -1 for a root
  std::vector<int> order;        ///< joints of the forest, parents first, as given otherwise
  std::vector<int> loop_joints;  ///< the other joints, as given
};

SpanningForest make_spanning_forest(const MachineGraph& graph);

/// The joints of the loop that a loop joint closes: from where the paths of its two links meet down
/// to its parent, the loop joint itself, and back up from its child.
std::vector<int> loop_of(const MachineGraph& graph, const SpanningForest& forest, int loop_joint);

}  // namespace linkwise
