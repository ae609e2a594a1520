#include "linkwise/model/joint_types.hpp"

#include <sstream>

#include "linkwise/base/named.hpp"

namespace linkwise {

using enum ElementKind;

const JointTypeInfo joint_type_table[n_joint_types] = {
    {JointType::fixed, "fixed", 0, 1, {{fixed}}, "", ""},
    {JointType::revolute, "revolute", 1, 1, {{revolute, 0}}, "", ""},
    {JointType::continuous, "continuous", 1, 1, {{revolute, 0}}, "", ""},
    {JointType::prismatic, "prismatic", 1, 1, {{prismatic, 0}}, "", ""},
    {JointType::helical, "helical", 1, 1, {{helical, 0}}, "", ""},
    {JointType::cylindrical,
     "cylindrical",
     1,
     2,
     {{prismatic, 0}, {revolute, 0}},
     "translation angle",
     "v w"},
    {JointType::universal,
     "universal",
     2,
     2,
     {{revolute, 0}, {revolute, 1}},
     "angle1 angle2",
     "w1 w2"},
    {JointType::spherical, "spherical", 0, 1, {{spherical}}, "qx qy qz qw", "wx wy wz"},
    {JointType::planar, "planar", 1, 1, {{planar, 0}}, "x y angle", "vx vy wz"},
    {JointType::floating, "floating", 0, 1, {{floating}}, "x y z qx qy qz qw", "vx vy vz wx wy wz"},
    {JointType::composite, "composite", -1, -1, {}, "1 2 3 4 5 6", "1 2 3 4 5 6"},
    {JointType::elastic, "elastic", 0, 1, {{elastic}}, "", ""},
};

namespace {

std::vector<std::string> words(const char* text) {
  std::istringstream stream(text);
  std::vector<std::string> out;
  for (std::string word; stream >> word;) out.push_back(word);
  return out;
}

/// Of a beam (bodies/beam.hpp): how far it stretches, where it does; twist; deflections. Of a modal
/// body (bodies/modal.hpp): its modes.
std::vector<ScalarLabel> elastic_labels(BodyKind kind, int n) {
  std::vector<ScalarLabel> out;
  if (kind == BodyKind::modal) {
    for (int k = 1; k <= n; ++k) out.push_back({"mode" + std::to_string(k), "m"});
    return out;
  }
  const bool stretches = n % 2 == 0;
  const int in_plane = (n - 1 - stretches) / 2;
  if (stretches) out.push_back({"stretch", "m"});
  out.push_back({"twist", "rad"});
  for (const char* plane : {"y", "z"})
    for (int k = 1; k <= in_plane; ++k) out.push_back({plane + std::to_string(k), "m"});
  return out;
}

std::vector<ScalarLabel> labels(const JointSpec& joint, const char* suffixes,
                                const char* ElementKindInfo::*units) {
  if (joint.type == JointType::elastic)
    return elastic_labels(joint.parent_kind, joint.n_coordinates);
  std::vector<ScalarLabel> out;
  for (int k = 0; k < n_joint_elements(joint); ++k)
    for (const std::string& unit : words(info_of(joint_element(joint, k).kind).*units))
      out.push_back({"", unit});
  const std::vector<std::string> names = words(suffixes);
  if (out.size() > 1)
    for (size_t k = 0; k < out.size(); ++k) out[k].suffix = names.at(k);
  return out;
}

}  // namespace

ElementKind element_kind(AxisKind kind) {
  return kind == AxisKind::revolute ? revolute : kind == AxisKind::prismatic ? prismatic : helical;
}

int n_joint_elements(const JointSpec& joint) {
  const int n = info_of(joint.type).n_elements;
  return n < 0 ? static_cast<int>(joint.axes.size()) : n;
}

JointElement joint_element(const JointSpec& joint, int k) {
  const JointTypeInfo& info = info_of(joint.type);
  return info.n_elements < 0 ? JointElement{element_kind(joint.axes[k].kind), k} : info.elements[k];
}

int joint_dof(const JointSpec& joint) {
  int dof = 0;
  for (int k = 0; k < n_joint_elements(joint); ++k) dof += element_size(joint, k).nv;
  return dof;
}

ElementSize element_size(const JointSpec& joint, int k) {
  const ElementKind kind = joint_element(joint, k).kind;
  if (kind == elastic) return {joint.n_coordinates, joint.n_coordinates};
  return {info_of(kind).nq, info_of(kind).nv};
}

JointType joint_type_from_name(const std::string& name) {
  return find_named("joint type", name, joint_type_table).type;
}

std::vector<ScalarLabel> coordinate_labels(const JointSpec& joint) {
  return labels(joint, info_of(joint.type).q_labels, &ElementKindInfo::q_units);
}

std::vector<ScalarLabel> rate_labels(const JointSpec& joint) {
  return labels(joint, info_of(joint.type).v_labels, &ElementKindInfo::v_units);
}

}  // namespace linkwise
