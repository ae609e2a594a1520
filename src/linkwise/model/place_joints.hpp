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

/// The elements of a joint, the first one like `first` but for what it is and where: `to_joint`
/// leads from the frame before it to the joint's own axes at zero. Returns last element's frame ->
/// the joint's axes there, a turn.
Transform<double> append_elements(const JointSpec& joint, Element first, Transform<double> to_joint,
                                  std::vector<Element>& elements);

/// Where every link of the spec is: on the joint that moves its lump, or on the ground.
std::vector<LinkInfo> place_links(const Machine& machine, const Lumps& lumps,
                                  const LumpedInertia& lumped, const PlacedJoints& placed);

}  // namespace linkwise
