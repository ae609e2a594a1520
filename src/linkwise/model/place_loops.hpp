#pragma once
// The joints that close loops: how they lie on the two bodies that they join.
#include "linkwise/model/place_joints.hpp"

namespace linkwise {

/// Loop joints in the order of the forest. `links` are those of place_links, and body frames are
/// final.
LoopJoints place_loops(const Machine& machine, const SpanningForest& forest,
                       const std::vector<JointInfo>& joints, const std::vector<LinkInfo>& links);

}  // namespace linkwise
