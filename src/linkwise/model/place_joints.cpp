#include "linkwise/model/place_joints.hpp"

#include "linkwise/model/joint_types.hpp"
#include "linkwise/model/validate.hpp"

namespace linkwise {
namespace {

using Xform = Transform<double>;

/// The smallest rotation that takes z to the unit vector a, as a matrix whose columns are the
/// turned axes; a half turn about x first when a points down, so that it never degenerates.
Mat3<double> align_z(Vec3<double> a) {
  const bool down = a.z < 0;
  if (down) a = {a.x, -a.y, -a.z};
  const double k = 1 / (1 + a.z);
  Mat3<double> R{{1 - a.x * a.x * k, -a.x * a.y * k, a.x, -a.x * a.y * k, 1 - a.y * a.y * k, a.y,
                  -a.x, -a.y, a.z}};
  if (down)
    for (int j = 3; j < 9; ++j) R.m[j] = -R.m[j];
  return R;
}

}  // namespace

Xform append_elements(const JointSpec& joint, Element e, Xform to_joint,
                      std::vector<Element>& elements) {
  Xform to_user{Mat3<double>::identity(), {}};
  const auto push = [&](int k, ElementKind kind, const Mat3<double>& A, double pitch) {
    e.kind = kind;
    e.nq = element_size(joint, k).nq;
    e.nv = element_size(joint, k).nv;
    e.pitch = pitch;
    e.placement = Xform{transpose(A), {}} * to_joint;
    elements.push_back(e);
    e.q += e.nq;
    e.v += e.nv;
    // The next element starts from this frame, turned back to the user's axes.
    to_joint = to_user = Xform{A, {}};
  };
  for (int k = 0; k < n_joint_elements(joint); ++k) {
    const auto [kind, axis] = joint_element(joint, k);
    if (axis < 0)
      push(k, kind, Mat3<double>::identity(), 0);
    else
      push(k, kind, align_z(joint.axes[axis].axis),
           kind == ElementKind::helical ? joint.axes[axis].pitch : 0);
  }
  return to_user;
}

PlacedJoints place_joints(const Machine& machine, const Lumps& lumps, const LumpedInertia& lumped,
                          const BodyTree& tree) {
  const MachineGraph& graph = machine.graph;
  PlacedJoints out;
  out.joints.reserve(lumps.moving.size());
  out.elements.reserve(lumps.moving.size());
  std::vector<int> joint_of(graph.n_links(), -1);  // by lead: what moves it
  for (int j : lumps.moving) {
    const JointSpec& s = machine.joint(j);
    JointInfo info;
    info.name = s.name;
    info.type = s.type;
    info.link = graph.joints[j].child;
    info.spec = j;
    info.q = out.nq;
    info.v = out.nv;
    for (int k = 0; k < n_joint_elements(s); ++k) {
      info.nq += element_size(s, k).nq;
      info.nv += element_size(s, k).nv;
    }
    append_dof_properties(s, machine.where, out.dof);
    out.nq += info.nq;
    out.nv += info.nv;
    joint_of[info.link] = static_cast<int>(out.joints.size());
    out.joints.push_back(std::move(info));
  }
  for (int i : tree.joints) {
    const int j = lumps.moving[i], parent = graph.joints[j].parent;
    const JointSpec& s = machine.joint(j);
    Xform to_joint = Xform{transpose(s.rotation), s.translation} * lumped.from_lead[parent];
    if (const int before = joint_of[lumps.lead[parent]]; before >= 0)
      to_joint = to_joint * out.joints[before].to_user;
    JointInfo& info = out.joints[i];
    info.first_element = static_cast<int>(out.elements.size());
    info.n_elements = n_joint_elements(s);
    Element first;
    first.q = info.q;
    first.v = info.v;
    first.joint = i;
    first.prescribed = machine.prescribed[j];
    info.to_user = append_elements(s, first, to_joint, out.elements);
  }
  return out;
}

std::vector<LinkInfo> place_links(const Machine& machine, const Lumps& lumps,
                                  const LumpedInertia& lumped, const PlacedJoints& placed) {
  std::vector<int> joint_of(machine.graph.n_links(), -1);
  for (size_t i = 0; i < placed.joints.size(); ++i)
    joint_of[placed.joints[i].link] = static_cast<int>(i);
  std::vector<LinkInfo> links;
  links.reserve(machine.n_links());
  for (int l = 0; l < machine.n_links(); ++l)
    links.push_back({machine.link_name(l), joint_of[lumps.lead[l]], lumped.from_lead[l]});
  return links;
}

}  // namespace linkwise
