#pragma once
// A checked spec as a graph, and what the graph's links and joints stand for.
#include <string>
#include <vector>

#include "linkwise/graph/body_tree.hpp"
#include "linkwise/model/name_index.hpp"
#include "linkwise/model/spec.hpp"

namespace linkwise {

/// Indices of the graph are those of the spec. A floating base adds one link, the ground, and one
/// joint, from the ground to the root link, behind the spec's.
struct Machine {
  const ModelSpec& spec;
  std::string where;  ///< " of arm.urdf" or ""
  JointSpec floating_joint;
  MachineGraph graph;
  std::vector<char> prescribed;  ///< by joint

  int n_links() const { return static_cast<int>(spec.links.size()); }
  const JointSpec& joint(int j) const {
    return j < static_cast<int>(spec.joints.size()) ? spec.joints[j] : floating_joint;
  }
  const std::string& link_name(int l) const { return spec.links[l].name; }
};

/// Names of the links by index; InputError where one is used twice.
NameIndex index_links(const ModelSpec& spec, const std::string& where);

/// Throws InputError where a joint's name is used twice or names a link that does not exist.
Machine make_machine(const ModelSpec& spec, const NameIndex& links, const std::string& where);

/// Throws InputError unless the forest is one tree without loop joints: the recursion takes no
/// loops yet.
void require_tree(const Machine& machine, const SpanningForest& forest);

}  // namespace linkwise
