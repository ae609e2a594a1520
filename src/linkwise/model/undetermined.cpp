#include "linkwise/model/undetermined.hpp"

#include <algorithm>

#include "linkwise/model/joint_types.hpp"
#include "linkwise/model/validate.hpp"
#include "linkwise/spatial/composite.hpp"

namespace linkwise {
namespace {

constexpr size_t most_named = 20;

/// Has every degree of freedom of the joint a rotor?
bool has_armature(const JointSpec& joint) {
  for (const DofValue& given : joint.dof)
    if (given.property == DofProperty::armature && !given.values.empty())
      return std::all_of(given.values.begin(), given.values.end(), [](double x) { return x > 0; });
  return false;
}

double along(const Sym3<double>& I, const Vec3<double>& a) {
  const double x[3] = {a.x, a.y, a.z};
  double sum = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sum += x[i] * I.m[packed(i, j)] * x[j];
  return sum;
}

/// Can the joint turn the body, which is about the joint's point, without giving it energy?
bool turns_freely(const JointSpec& joint, const Inertia<double>& body) {
  double whole[3];
  principal_moments(body.I, whole);
  const double nothing = 1e-14 * whole[2];
  Sym3<double> central = body.I;
  if (body.m > 0) add_point_mass(central, -body.m, (1 / body.m) * body.mc);
  double principal[3];
  switch (joint.type) {
    case JointType::revolute:
    case JointType::continuous:
      return along(body.I, joint.axes[0].axis) <= nothing;
    case JointType::spherical:
      return whole[0] <= nothing;
    case JointType::planar:
      return along(central, joint.axes[0].axis) <= nothing;
    case JointType::floating:
      principal_moments(central, principal);
      return principal[0] <= nothing;
    default:
      return false;
  }
}

std::string listed(const std::vector<std::string>& names) {
  std::string out;
  for (size_t i = 0; i < std::min(names.size(), most_named); ++i)
    out += (i == 0 ? "'" : ", '") + names[i] + "'";
  if (names.size() > most_named)
    out += " and " + std::to_string(names.size() - most_named) + " more";
  return out;
}

}  // namespace

std::string find_undetermined(const Machine& machine, const Lumps& lumps,
                              const LumpedInertia& lumped, std::vector<Note>& notes) {
  std::vector<std::string> links, joints;
  for (int j : lumps.moving) {
    const int link = machine.graph.joints[j].child;
    const JointSpec& joint = machine.joint(j);
    const bool light = lumps.light[link];
    if (machine.prescribed[j] || joint_dof(joint) == 0 || has_armature(joint)) continue;
    if (!light && (lumps.outboard[link] > 0 || !turns_freely(joint, lumped.inertia[link])))
      continue;
    links.push_back(machine.link_name(link));
    joints.push_back(joint.name);
    notes.push_back(
        {NoteLevel::warning, links.back(),
         std::string(light ? "has no mass" : "has no inertia about an axis that turns") +
             ", but joint '" + joint.name + "' can move it: its acceleration is not determined"});
  }
  if (links.empty()) return "";
  return (links.size() > 1 ? "links " : "link ") + listed(links) + machine.where +
         (links.size() > 1 ? " have" : " has") + " no mass or no inertia where " +
         (joints.size() > 1 ? "joints " : "joint ") + listed(joints) + " can move " +
         (links.size() > 1 ? "them" : "it") +
         ", so accelerations are not determined; give mass and inertia (with_link, or [link.\"" +
         links.front() +
         "\"] in a scenario), or make the joint fixed, lock it, or give it armature";
}

}  // namespace linkwise
