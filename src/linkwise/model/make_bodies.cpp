#include "linkwise/model/make_bodies.hpp"

#include <span>

#include "linkwise/base/error.hpp"

namespace linkwise {
namespace {

void note_stack(const Machine& machine, const PlacedJoints& placed, std::span<const int> stack,
                std::vector<Note>& notes) {
  for (size_t k = 0; k + 1 < stack.size(); ++k)
    notes.push_back({NoteLevel::merge, machine.link_name(placed.joints[stack[k]].link),
                     "has no mass: joint '" + placed.joints[stack[k]].name + "' is stacked with '" +
                         placed.joints[stack[k + 1]].name + "'"});
}

/// Bodies on one element that is free have loops of their own in the sweeps.
void classify(const PlacedJoints& placed, BodyTopology& body, BodyConstants<double>& constants) {
  if (body.n_elements != 1) return;
  const Element& e = placed.elements[body.first_element];
  body.q = e.q;
  body.v = e.v;
  if (e.prescribed || e.nv != 1) return;
  constants.pitch = e.pitch;
  constants.armature = placed.dof[static_cast<int>(DofProperty::armature)][e.v];
  body.joint_kind = e.kind == ElementKind::prismatic ? JointKind::prismatic
                    : e.kind == ElementKind::helical ? JointKind::helical
                    : constants.armature > 0         ? JointKind::geared
                                                     : JointKind::revolute;
}

/// Body b from its link and the inertia of all that is welded to it. X takes the body frame to the
/// link's.
void set_body(const LinkSpec& link, const Inertia<double>& inertia, const Transform<double>& X,
              Bodies& out, int b) {
  BodyTopology& at = out.topology[b];
  at.body_kind = link.body_kind;
  BodyKinds::dispatch(at.body_kind, [&](auto kind) {
    using B = typename decltype(kind)::Body;
    if constexpr (!std::is_same_v<B, RigidBody<double>>) {
      std::vector<B>& bodies = std::get<std::vector<B>>(out.others);
      at.of_kind = static_cast<int>(bodies.size());
      bodies.emplace_back();
    }
    body_of_kind<B>(at, out.constants[b], out.others) =
        moved(B::make(RigidBody<double>{inertia}, link.parameters), X);
  });
}

/// Gives coordinates of body b's own their places behind all others, and their properties.
template <class B>
void place_coordinates(const B& body, int joint, PlacedJoints& placed, Bodies& out, int b) {
  if (out.own_element.empty()) out.own_element.assign(out.topology.size(), -1);
  out.own_element[b] = static_cast<int>(placed.elements.size());
  for (int k = 0; k < B::n_coordinates; ++k) {
    Element element;
    element.kind = ElementKind::own;
    element.q = placed.nq++;
    element.v = placed.nv++;
    element.joint = joint;
    placed.elements.push_back(element);
    for (int p = 0; p < n_dof_properties; ++p)
      placed.dof[p].push_back(dof_property_table[p].fallback);
    placed.dof[static_cast<int>(DofProperty::stiffness)].back() = body.stiffness(k);
    placed.dof[static_cast<int>(DofProperty::damping)].back() = body.damping(k);
  }
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
    note_stack(machine, placed, stack, notes);
    set_body(machine.spec.links[given.link], lumped.inertia[given.link],
             placed.joints[stack.back()].to_user, out, b);
    constants.tree = placed.elements[body.first_element + body.n_elements - 1].placement;
    classify(placed, body, constants);
    if (body.joint_kind == JointKind::general) body.general = out.n_general++;
    if (out.singular < 0 && is_singular(lumped.inertia[given.link])) out.singular = b;
    if (body.parent >= 0) ++out.topology[body.parent].n_children;
  }
  for (int b = 0; BodyKinds::any_coordinates && b < n; ++b)
    BodyKinds::dispatch(out.topology[b].body_kind, [&](auto kind) {
      using B = typename decltype(kind)::Body;
      if constexpr (has_coordinates<B>)
        place_coordinates(body_of_kind<B>(out.topology[b], out.constants[b], out.others),
                          joints_of(tree, b).back(), placed, out, b);
    });
  return out;
}

}  // namespace linkwise
