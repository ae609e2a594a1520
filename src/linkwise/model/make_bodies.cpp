#include "linkwise/model/make_bodies.hpp"

#include <span>

#include "linkwise/base/error.hpp"
#include "linkwise/spatial/composite.hpp"

namespace linkwise {
namespace {

void check_stack(const Machine& machine, const PlacedJoints& placed, std::span<const int> stack,
                 int nv, std::vector<Note>& notes) {
  const auto link = [&](int joint) { return machine.link_name(placed.joints[joint].link); };
  if (nv > 6) {
    std::string names;
    for (int i : stack.first(stack.size() - 1)) names += (names.empty() ? "'" : "', '") + link(i);
    throw InputError("links " + names + "'" + machine.where + " have no mass and leave " +
                     std::to_string(nv) + " degrees of freedom between '" + link(stack.back()) +
                     "' and the next inboard mass (6 at most); give one of them a mass and an "
                     "inertia");
  }
  for (size_t k = 0; k + 1 < stack.size(); ++k)
    notes.push_back({NoteLevel::merge, link(stack[k]),
                     "has no mass: joint '" + placed.joints[stack[k]].name + "' is stacked with '" +
                         placed.joints[stack[k + 1]].name + "'"});
}

/// Bodies on one element that is free have loops of their own in the sweeps.
void classify(const PlacedJoints& placed, BodyTopology& body, BodyConstants<double>& constants) {
  if (body.n_elements != 1) return;
  const Element& e = placed.elements[body.first_element];
  body.q = e.q;
  body.v = e.v;
  body.nq = e.nq;
  if (e.prescribed || e.nv != 1) return;
  constants.pitch = e.pitch;
  constants.armature = placed.dof[static_cast<int>(DofProperty::armature)][e.v];
  body.joint_kind = e.kind == ElementKind::prismatic ? JointKind::prismatic
                    : e.kind == ElementKind::helical ? JointKind::helical
                    : constants.armature > 0         ? JointKind::geared
                                                     : JointKind::revolute;
}

}  // namespace

Bodies make_bodies(const Machine& machine, const LumpedInertia& lumped, const BodyTree& tree,
                   PlacedJoints& placed, std::vector<Note>& notes) {
  const int n = static_cast<int>(tree.bodies.size());
  Bodies out;
  out.topology.resize(n);
  out.constants.resize(n);
  for (int b = 0; b < n; ++b) {
    const BodyTree::Body& given = tree.bodies[b];
    const std::span<const int> stack = joints_of(tree, b);
    BodyTopology& body = out.topology[b];
    BodyConstants<double>& constants = out.constants[b];
    body.parent = given.parent;
    body.first_element = placed.joints[stack.front()].first_element;
    for (int i : stack) {
      JointInfo& joint = placed.joints[i];
      joint.body = b;
      joint.last_of_body = i == stack.back();
      body.nv += joint.nv;
      body.n_elements += joint.n_elements;
    }
    check_stack(machine, placed, stack, body.nv, notes);
    const Inertia<double>& inertia = lumped.inertia[given.link];
    // From the link's axes to the body frame's.
    constants.inertia = transform_to_parent(placed.joints[stack.back()].to_user, inertia);
    constants.tree = placed.elements[body.first_element + body.n_elements - 1].placement;
    classify(placed, body, constants);
    if (body.joint_kind == JointKind::general) body.general = out.n_general++;
    if (out.singular < 0 && is_singular(inertia)) out.singular = b;
    if (body.parent >= 0) ++out.topology[body.parent].n_children;
  }
  return out;
}

}  // namespace linkwise
