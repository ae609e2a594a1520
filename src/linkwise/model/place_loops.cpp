#include "linkwise/model/place_loops.hpp"

#include "linkwise/model/joint_types.hpp"
#include "linkwise/model/validate.hpp"

namespace linkwise {
namespace {

using Xform = Transform<double>;

/// A link's body, and how the link lies on it.
struct Place {
  int body = -1;
  Xform from_body;  ///< body frame -> link frame
};

Place place_of(const LinkInfo& link, const std::vector<JointInfo>& joints) {
  if (link.joint < 0) return {-1, link.placement};
  const JointInfo& joint = joints[link.joint];
  return {joint.body, link.placement * joint.to_user};
}

}  // namespace

LoopJoints place_loops(const Machine& machine, const SpanningForest& forest,
                       const std::vector<JointInfo>& joints, const std::vector<LinkInfo>& links) {
  LoopJoints out;
  const auto first_given = static_cast<int>(machine.spec.joints.size());
  for (const int j : forest.loop_joints) {
    const auto& edge = machine.graph.joints[j];
    const JointSpec& spec = machine.joint(j);
    const Place parent = place_of(links[edge.parent], joints),
                child = place_of(links[edge.child], joints);
    LoopJoint loop;
    loop.parent_link = edge.parent;
    loop.parent_body = parent.body;
    loop.on_parent = Xform{transpose(spec.rotation), spec.translation} * parent.from_body;

    JointInfo& joint = loop.joint;
    joint.name = spec.name;
    joint.type = spec.type;
    joint.link = edge.child;
    joint.body = child.body;
    joint.spec = j;
    joint.q = out.nq;
    joint.v = out.nv;
    joint.first_element = static_cast<int>(out.elements.size());
    joint.n_elements = n_joint_elements(spec);
    Element first;
    first.q = joint.q;
    first.v = joint.v;
    first.joint = static_cast<int>(out.joints.size());
    first.prescribed = machine.prescribed[j];
    joint.to_user = append_elements(spec, first, {Mat3<double>::identity(), {}}, out.elements);
    for (int k = 0; k < joint.n_elements; ++k) {
      joint.nq += out.elements[joint.first_element + k].nq;
      joint.nv += out.elements[joint.first_element + k].nv;
    }
    out.nq += joint.nq;
    out.nv += joint.nv;
    append_dof_properties(spec, machine.where, out.dof);

    const Xform to_last{transpose(joint.to_user.R), {}};  // a turn, as append_elements says
    Xform on_child{Mat3<double>::identity(), {}};         // a joint of the tree lies in its child
    if (j >= first_given) {
      const LoopJointSpec& given = machine.spec.loop_joints[j - first_given];
      on_child = {transpose(given.child_rotation), given.child_translation};
      loop.kind = given.kind;
      loop.length = given.length;
    }
    loop.on_child = to_last * on_child * child.from_body;
    out.joints.push_back(std::move(loop));
  }
  return out;
}

}  // namespace linkwise
