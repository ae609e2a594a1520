#pragma once
// The arrays over bodies: how each is joined, its constants, and what it is.
#include "linkwise/model/place_joints.hpp"

namespace linkwise {

struct Bodies {
  std::vector<BodyTopology> topology;
  std::vector<BodyConstants<double>> constants;
  BodyKinds::Bodies others;      ///< that are not rigid
  std::vector<int> own_element;  ///< as in Model
  int n_general = 0;
  int singular = -1;  ///< the first whose inertia is singular, -1: none
};

/// Bodies from the tree, and in `placed` which joint belongs to which, and their own coordinates.
Bodies make_bodies(const Machine& machine, const LumpedInertia& lumped, const BodyTree& tree,
                   PlacedJoints& placed, std::vector<Note>& notes);

}  // namespace linkwise
