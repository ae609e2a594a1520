#pragma once
// Coordinates, frames and elementary motions of the joints.
#include <array>
#include <vector>

#include "linkwise/model/lumped_inertia.hpp"

namespace linkwise {

struct PlacedJoints {
  std::vector<JointInfo> joints;  ///< in the order of Lumps::moving
  std::vector<Element> elements;  ///< body by body
  std::array<std::vector<double>, n_dof_properties> dof;
  int nq = 0, nv = 0;
};

/// Gives every moving joint its place in q and v and its elements their frames, which are turned so
/// that axes lie along z. Throws InputError on joint properties that are wrong.
PlacedJoints place_joints(const Machine& machine, const Lumps& lumps, const LumpedInertia& lumped,
                          const BodyTree& tree);

/// Where every link of the spec is: on the joint that moves its lump, or on the ground.
std::vector<LinkInfo> place_links(const Machine& machine, const Lumps& lumps,
                                  const LumpedInertia& lumped, const PlacedJoints& placed);

}  // namespace linkwise
