#include "linkwise/model/undetermined.hpp"

#include <algorithm>

#include "linkwise/model/joint_types.hpp"
#include "linkwise/model/validate.hpp"
#include "linkwise/spatial/composite.hpp"

namespace linkwise {
namespace {

constexpr size_t most_named = 20;

/// Degrees of freedom without a rotor.
int without_armature(const JointSpec& joint) {
  if (joint.type == JointType::elastic) return 0;  // its body has mass for each of them
  const int all = joint_dof(joint);
  for (const DofValue& given : joint.dof) {
    if (given.property != DofProperty::armature) continue;
    const auto turned = static_cast<int>(
        std::count_if(given.values.begin(), given.values.end(), [](double x) { return x > 0; }));
    return given.values.size() == 1 && turned == 1 ? 0 : all - turned;
  }
  return all;
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

struct Found {
  std::vector<std::string> links, joints;
  bool in_a_row = false;
};

/// What nothing with mass hangs on, and a last body without inertia about an axis that turns.
void find_ends(const Machine& machine, const Lumps& lumps, const LumpedInertia& lumped, Found& out,
               std::vector<Note>& notes) {
  for (int j : lumps.moving) {
    const int link = machine.graph.joints[j].child;
    const JointSpec& joint = machine.joint(j);
    const bool light = lumps.light[link];
    if (machine.prescribed[j] || without_armature(joint) == 0) continue;
    if (!light && (lumps.outboard[link] > 0 || !turns_freely(joint, lumped.inertia[link])))
      continue;
    out.links.push_back(machine.link_name(link));
    out.joints.push_back(joint.name);
    notes.push_back(
        {NoteLevel::warning, out.links.back(),
         std::string(light ? "has no mass" : "has no inertia about an axis that turns") +
             ", but joint '" + joint.name + "' can move it: its acceleration is not determined"});
  }
}

/// Rows of joints with massless links between them, and more freedom than the six motions of what
/// they carry.
void find_rows(const Machine& machine, const Lumps& lumps, Found& out, std::vector<Note>& notes) {
  const MachineGraph& graph = machine.graph;
  std::vector<int> inboard(graph.n_links(), -1);  // by lead: the joint that moves it
  for (int j : lumps.moving) inboard[graph.joints[j].child] = j;
  for (int j : lumps.moving) {
    const int end = graph.joints[j].child;
    if (lumps.light[end] || is_between(lumps, end)) continue;
    std::vector<std::string> links, joints;
    int freedom = 0;
    for (int at = j; at >= 0;) {
      if (!machine.prescribed[at]) freedom += without_armature(machine.joint(at));
      joints.push_back(machine.joint(at).name);
      const int parent = lumps.lead[graph.joints[at].parent];
      at = is_between(lumps, parent) ? inboard[parent] : -1;
      if (at >= 0) links.push_back(machine.link_name(parent));
    }
    if (freedom <= most_stacked) continue;
    std::reverse(links.begin(), links.end());
    std::reverse(joints.begin(), joints.end());
    notes.push_back({NoteLevel::warning, links.front(),
                     "links " + listed(links) + " have no mass, and joints " + listed(joints) +
                         " leave '" + machine.link_name(end) + "' " + std::to_string(freedom) +
                         " degrees of freedom without armature, 6 at most are determined"});
    out.links.insert(out.links.end(), links.begin(), links.end());
    out.joints.insert(out.joints.end(), joints.begin(), joints.end());
    out.in_a_row = true;
  }
}

}  // namespace

std::string find_undetermined(const Machine& machine, const Lumps& lumps,
                              const LumpedInertia& lumped, std::vector<Note>& notes) {
  Found found;
  find_ends(machine, lumps, lumped, found, notes);
  find_rows(machine, lumps, found, notes);
  const auto& [links, joints, in_a_row] = found;
  if (links.empty()) return "";
  return (links.size() > 1 ? "links " : "link ") + listed(links) + machine.where +
         (links.size() > 1 ? " have" : " has") + " no mass or no inertia where " +
         (joints.size() > 1 ? "joints " : "joint ") + listed(joints) + " can move " +
         (links.size() > 1 ? "them" : "it") +
         (in_a_row ? " (more than 6 degrees of freedom in a row)" : "") +
         ", so accelerations are not determined; give mass and inertia (with_link, or [link.\"" +
         links.front() +
         "\"] in a scenario), or make the joint fixed, lock it, or give it armature";
}

}  // namespace linkwise
