#include "linkwise/model/make_bodies.hpp"

#include <algorithm>
#include <cmath>
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
  if (e.prescribed || e.nv != 1 || e.kind == ElementKind::elastic) return;
  if (body.body_kind != BodyKind::rigid) return;  // kinematics/kind_ranges.hpp
  constants.pitch = e.pitch;
  constants.armature = placed.dof[static_cast<int>(DofProperty::armature)][e.v];
  body.joint_kind = e.kind == ElementKind::prismatic ? JointKind::prismatic
                    : e.kind == ElementKind::helical ? JointKind::helical
                    : constants.armature > 0         ? JointKind::geared
                                                     : JointKind::revolute;
}

/// The last body of each kind, before it was moved: one that is made of the same numbers shares
/// what it keeps.
struct LastMade {
  BodyKinds::Bodies bodies;
  const std::vector<double>* parameters[BodyKinds::size] = {};
};

template <class B>
B make_body(const LinkSpec& link, const Inertia<double>& inertia, LastMade& last) {
  const RigidBody<double> rigid{inertia};
  if constexpr (!has_coordinates<B>) {
    return B::make(rigid, link.parameters);
  } else {
    auto& bodies = std::get<std::vector<B>>(last.bodies);
    auto*& parameters = last.parameters[static_cast<int>(link.body_kind)];
    if (!parameters || *parameters != link.parameters)
      bodies.assign(1, B::make(rigid, link.parameters));
    parameters = &link.parameters;
    return bodies.front();
  }
}

/// Body b from its link and the inertia of all that is welded to it. X takes the body frame to the
/// link's.
void set_body(const LinkSpec& link, const Inertia<double>& inertia, const Transform<double>& X,
              LastMade& last, Bodies& out, int b) {
  BodyTopology& at = out.topology[b];
  at.body_kind = link.body_kind;
  BodyKinds::dispatch(at.body_kind, [&](auto kind) {
    using B = typename decltype(kind)::Body;
    if constexpr (!std::is_same_v<B, RigidBody<double>>) {
      std::vector<B>& bodies = std::get<std::vector<B>>(out.others);
      at.of_kind = static_cast<int>(bodies.size());
      bodies.emplace_back();
    }
    body_of_kind<B>(at, out.constants[b], out.others) = moved(make_body<B>(link, inertia, last), X);
  });
}

/// Gives coordinates of body b's own their places behind all others, and their properties.
template <class B>
void place_coordinates(const B& body, int joint, PlacedJoints& placed, Bodies& out, int b) {
  if (out.own_element.empty()) out.own_element.assign(out.topology.size(), -1);
  out.own_element[b] = static_cast<int>(placed.elements.size());
  for (int k = 0; k < body.n_coordinates(); ++k) {
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

/// The elastic element of a joint on the port of body b, whose coordinates are the body's.
template <class B>
void place_port(const B& body, const Machine& machine, const JointInfo& joint, Element& element,
                PlacedJoints& placed, Bodies& out, int b) {
  if (out.own_element.empty()) out.own_element.assign(out.topology.size(), -1);
  out.own_element[b] = joint.first_element;
  element.shape = body.port();
  const Transform<double> given = element.placement;
  element.placement = body.to_port_base();
  const Transform<double> straight =
      Transform<double>{Mat3<double>::identity(), element.shape->rest} * element.placement;
  const Vec3<double> gap = straight.r - given.r;
  double off = std::sqrt(dot(gap, gap));
  for (int i = 0; i < 9; ++i) off = std::max(off, std::abs(straight.R.m[i] - given.R.m[i]));
  if (off > 1e-9 * (1 + std::sqrt(dot(straight.r, straight.r))))
    throw InputError("joint '" + joint.name + "'" + machine.where +
                     ": is not at the end of its elastic link, or not along its axes; place it "
                     "there");
  for (int k = 0; k < joint.nv; ++k) {
    placed.dof[static_cast<int>(DofProperty::stiffness)][joint.v + k] = body.stiffness(k);
    placed.dof[static_cast<int>(DofProperty::damping)][joint.v + k] = body.damping(k);
  }
}

void place_ports(const Machine& machine, const BodyTree& tree, PlacedJoints& placed, Bodies& out) {
  for (size_t c = 0; c < out.topology.size(); ++c) {
    Element& element = placed.elements[out.topology[c].first_element];
    if (element.kind != ElementKind::elastic) continue;
    const int b = out.topology[c].parent;
    const JointInfo& joint = placed.joints[joints_of(tree, static_cast<int>(c)).front()];
    if (b < 0)
      throw InputError("joint '" + joint.name + "'" + machine.where +
                       ": hangs on the ground, which bends nowhere; hold the flexible link by a "
                       "fixed joint on another link");
    BodyKinds::dispatch(out.topology[b].body_kind, [&](auto kind) {
      using B = typename decltype(kind)::Body;
      if constexpr (has_coordinates<B>)
        place_port(body_of_kind<B>(out.topology[b], out.constants[b], out.others), machine, joint,
                   element, placed, out, b);
    });
  }
}

}  // namespace

Bodies make_bodies(const Machine& machine, const LumpedInertia& lumped, const BodyTree& tree,
                   PlacedJoints& placed, std::vector<Note>& notes) {
  const int n = static_cast<int>(tree.bodies.size());
  Bodies out;
  out.topology.resize(n);
  out.constants.resize(n);
  LastMade last;
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
             placed.joints[stack.back()].to_user, last, out, b);
    constants.tree = placed.elements[body.first_element + body.n_elements - 1].placement;
    classify(placed, body, constants);
    if (body.joint_kind == JointKind::general) body.general = out.n_general++;
    if (out.singular < 0 && is_singular(lumped.inertia[given.link])) out.singular = b;
    if (body.parent >= 0) ++out.topology[body.parent].n_children;
  }
  for (int b = 0; b < n; ++b)
    BodyKinds::dispatch(out.topology[b].body_kind, [&](auto kind) {
      using B = typename decltype(kind)::Body;
      if constexpr (has_coordinates<B>) {
        const B& body = body_of_kind<B>(out.topology[b], out.constants[b], out.others);
        if (!body.port()) place_coordinates(body, joints_of(tree, b).back(), placed, out, b);
      }
    });
  place_ports(machine, tree, placed, out);
  return out;
}

}  // namespace linkwise
