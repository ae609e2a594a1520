#pragma once
// A checked spec as a graph, and what the graph's links and joints stand for.
#include <string>
#include <vector>

#include "linkwise/graph/body_tree.hpp"
#include "linkwise/model/name_index.hpp"
#include "linkwise/model/spec.hpp"

namespace linkwise {

/// Indices of links are those of the spec. Joints are the spec's, then its loop joints. A floating
/// base adds one link, the ground, and one joint, from the ground to the root link, behind these.
struct Machine {
  const ModelSpec& spec;
  std::string where;  ///< " of arm.urdf" or ""
  JointSpec floating_joint;
  MachineGraph graph;
  std::vector<char> prescribed;  ///< by joint

  int n_links() const { return static_cast<int>(spec.links.size()); }
  const JointSpec& joint(int j) const { return joint_of(spec, j, floating_joint); }
  const std::string& link_name(int l) const { return spec.links[l].name; }
};

/// Names of the links by index; InputError where one is used twice.
NameIndex index_links(const ModelSpec& spec, const std::string& where);

/// Throws InputError where a joint's name is used twice or names a link that does not exist.
Machine make_machine(const ModelSpec& spec, const NameIndex& links, const std::string& where);

/// Throws InputError unless everything hangs together, and every loop joint joins two links that
/// can move against each other.
void check_forest(const Machine& machine, const SpanningForest& forest, const Lumps& lumps);

/// What closes a loop, which joints are on it, and how the ends are told from each other.
void note_loops(const Machine& machine, const SpanningForest& forest, std::vector<Note>& notes);

}  // namespace linkwise
