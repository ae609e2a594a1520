#include "linkwise/model/machine.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/base/error.hpp"
#include "linkwise/model/joint_types.hpp"
#include "linkwise/model/validate.hpp"

namespace linkwise {
namespace {

NameIndex index_joints(const ModelSpec& spec, const std::string& where) {
  NameIndex names;
  const JointSpec none;
  const int n = static_cast<int>(spec.joints.size() + spec.loop_joints.size());
  names.reset(n);
  const auto name_of = [&](int k) -> const auto& { return joint_of(spec, k, none).name; };
  for (int i = 0; i < n; ++i)
    if (!names.insert(i, name_of))
      throw InputError("joint '" + name_of(i) + "'" + where +
                       ": the name is used twice; rename one of them");
  return names;
}

int find_link(const ModelSpec& spec, const NameIndex& links, const std::string& name,
              const JointSpec& joint, const char* role, const std::string& where) {
  const int found = links.find(
      name, [&](int i) -> const auto& { return spec.links[i].name; });
  if (found >= 0) return found;
  std::vector<std::string> known;
  for (const auto& l : spec.links) known.push_back(l.name);
  throw InputError("joint '" + joint.name + "'" + where + ": " + role + " link '" + name +
                   "' does not exist" + suggest(name, known));
}

bool is_massless(const LinkSpec& link) {
  return link.mass == 0 &&
         std::all_of(link.inertia.m, link.inertia.m + 6, [](double x) { return x == 0; });
}

/// Has the joint properties by which it acts along its own coordinates?
bool acts(const JointSpec& joint) {
  const auto counts = [](const DofValue& given) {
    const bool limit = given.property == DofProperty::lower || given.property == DofProperty::upper;
    for (DofProperty p : {DofProperty::damping, DofProperty::friction, DofProperty::stiffness,
                          DofProperty::armature, DofProperty::limit_stiffness})
      if (given.property == p)
        return std::any_of(given.values.begin(), given.values.end(),
                           [](double x) { return x > 0; });
    return limit && std::any_of(given.values.begin(), given.values.end(),
                                [](double x) { return std::isfinite(x); });
  };
  return std::any_of(joint.dof.begin(), joint.dof.end(), counts);
}

/// By link: has it mass, or has anything that hangs on it?
std::vector<char> links_that_carry(const MachineGraph& graph) {
  std::vector<std::vector<int>> parents(graph.n_links());
  for (const auto& joint : graph.joints)
    if (!joint.closes) parents[joint.child].push_back(joint.parent);
  std::vector<char> carries(graph.n_links(), 0);
  std::vector<int> waiting;
  const auto mark = [&](int link) {
    if (!carries[link]) waiting.push_back(link);
    carries[link] = 1;
  };
  for (int l = 0; l < graph.n_links(); ++l)
    if (!graph.massless[l]) mark(l);
  while (!waiting.empty()) {
    const int link = waiting.back();
    waiting.pop_back();
    for (int parent : parents[link]) mark(parent);
  }
  return carries;
}

/// The link that no joint has as child; the first of them, or the first of all.
int root_link(const MachineGraph& graph) {
  std::vector<char> is_child(graph.n_links(), 0);
  for (const auto& joint : graph.joints)
    if (!joint.closes) is_child[joint.child] = 1;
  const auto root = std::find(is_child.begin(), is_child.end(), 0);
  return root == is_child.end() ? 0 : static_cast<int>(root - is_child.begin());
}

void add_floating_base(Machine& machine) {
  const ModelSpec& spec = machine.spec;
  MachineGraph& graph = machine.graph;
  for (int j = 0; j < graph.n_joints(); ++j)
    if (machine.joint(j).name == spec.floating_joint)
      throw InputError("joint '" + machine.joint(j).name + "'" + machine.where +
                       ": the floating base needs this name; rename the joint");
  machine.floating_joint.name = spec.floating_joint;
  machine.floating_joint.type = JointType::floating;
  machine.floating_joint.child = machine.link_name(graph.ground);
  const int root = graph.ground;
  graph.ground = graph.n_links();
  graph.massless.push_back(1);
  graph.joints.push_back({graph.ground, root, joint_dof(machine.floating_joint)});
}

std::string names_of(const Machine& machine, const std::vector<int>& joints) {
  const size_t shown = std::min<size_t>(joints.size(), 8);
  std::string names;
  for (size_t i = 0; i < shown; ++i) {
    if (i > 0) names += i + 1 < joints.size() ? ", " : " and ";
    names += "'" + machine.joint(joints[i]).name + "'";
  }
  return shown < joints.size() ? names + " ..." : names;
}

}  // namespace

NameIndex index_links(const ModelSpec& spec, const std::string& where) {
  NameIndex names;
  names.reset(spec.links.size());
  for (size_t i = 0; i < spec.links.size(); ++i)
    if (!names.insert(
            static_cast<int>(i), [&](int k) -> const auto& { return spec.links[k].name; }))
      throw InputError("link '" + spec.links[i].name + "'" + where +
                       ": the name is used twice; rename one of them");
  return names;
}

Machine make_machine(const ModelSpec& spec, const NameIndex& links, const std::string& where) {
  Machine machine{spec, where, {}, {}, {}};
  MachineGraph& graph = machine.graph;
  const NameIndex names = index_joints(spec, where);
  for (const LinkSpec& link : spec.links) graph.massless.push_back(is_massless(link));
  const int n_joints = static_cast<int>(spec.joints.size() + spec.loop_joints.size());
  graph.joints.reserve(n_joints + 1);
  for (int i = 0; i < n_joints; ++i) {
    const JointSpec& j = machine.joint(i);
    const int parent = find_link(spec, links, j.parent, j, "parent", where);
    const int child = find_link(spec, links, j.child, j, "child", where);
    if (parent == child)
      throw InputError("joint '" + j.name + "'" + where + ": link '" + j.child +
                       "' is its parent and its child; give it two links");
    const bool closes = i >= static_cast<int>(spec.joints.size());
    int dof = joint_dof(j);
    if (closes) {
      const LoopKind kind = spec.loop_joints[i - spec.joints.size()].kind;
      dof = kind == LoopKind::spring ? 6 : kind == LoopKind::rod ? 5 : dof;
    }
    // Only rigid bodies become one by a weld.
    const auto rigid = [&](int l) { return spec.links[l].body_kind == BodyKind::rigid; };
    const bool weld = !closes && j.type == JointType::fixed && rigid(parent) && rigid(child);
    graph.joints.push_back({parent, child, dof, acts(j), weld, closes,
                            j.type == JointType::composite || j.type == JointType::elastic});
    // The body behind an elastic joint moves with mass, that of the elastic body.
    if (j.type == JointType::elastic) graph.massless[child] = 0;
  }
  if (spec.keep_fixed) {
    const std::vector<char> carries = links_that_carry(graph);
    for (auto& joint : graph.joints) joint.weld = joint.weld && !carries[joint.child];
  }
  machine.prescribed.assign(n_joints + 1, 0);
  for (const std::string& name : spec.prescribed) {
    const int j = names.find(
        name, [&](int k) -> const auto& { return machine.joint(k).name; });
    if (const int loop = j - static_cast<int>(spec.joints.size());
        loop >= 0 && spec.loop_joints[loop].kind != LoopKind::joint)
      throw InputError("joint '" + name + "'" + where +
                       " is a rod or a spring, whose motion cannot be given; give that of a joint");
    if (j >= 0 && machine.joint(j).type == JointType::elastic)
      throw InputError("joint '" + name + "'" + where +
                       " is elastic, and its motion cannot be given; give that of a joint that is "
                       "not");
    if (j >= 0 || (spec.floating_base && name == spec.floating_joint))
      machine.prescribed[j >= 0 ? j : n_joints] = 1;
  }
  graph.ground = root_link(graph);
  if (spec.floating_base) add_floating_base(machine);
  return machine;
}

void check_forest(const Machine& machine, const SpanningForest& forest, const Lumps& lumps) {
  const MachineGraph& graph = machine.graph;
  for (int j : forest.loop_joints) {
    const int parent = graph.joints[j].parent, child = graph.joints[j].child;
    if (lumps.lead[parent] == lumps.lead[child])
      throw InputError("joint '" + machine.joint(j).name + "'" + machine.where + " joins links '" +
                       machine.link_name(parent) + "' and '" + machine.link_name(child) +
                       "', which fixed joints make one body; remove the joint");
    if (machine.joint(j).type == JointType::elastic)
      throw InputError("joint '" + machine.joint(j).name + "'" + machine.where +
                       " is elastic and cannot close a loop; let the other joint that leads to "
                       "link '" +
                       machine.link_name(child) + "' lead from it instead");
    if (machine.joint(j).type == JointType::composite)
      throw InputError("joint '" + machine.joint(j).name + "'" + machine.where +
                       " is composite and closes a loop of joints " +
                       names_of(machine, loop_of(graph, forest, j)) +
                       "; let a joint of another type lead to link '" +
                       machine.link_name(graph.joints[j].child) + "', which then closes the loop");
  }
  if (forest.roots.size() == 1) return;
  for (int j : forest.loop_joints)
    if (graph.joints[j].child == forest.roots[1] && !graph.joints[j].closes)
      throw InputError("joint '" + machine.joint(j).name + "'" + machine.where +
                       " closes a loop of joints " + names_of(machine, loop_of(graph, forest, j)) +
                       " that hangs on nothing; join link '" + machine.link_name(forest.roots[1]) +
                       "' to the rest");
  const int first = graph.ground < machine.n_links() ? graph.ground : graph.joints.back().child;
  throw InputError("links '" + machine.link_name(first) + "' and '" +
                   machine.link_name(forest.roots[1]) + "'" + machine.where +
                   " both have no parent; a model has one root: join them with a joint");
}

void note_loops(const Machine& machine, const SpanningForest& forest, std::vector<Note>& notes) {
  for (int j : forest.loop_joints)
    notes.push_back(
        {NoteLevel::info, machine.joint(j).name,
         "closes a loop of joints " + names_of(machine, loop_of(machine.graph, forest, j))});
}

}  // namespace linkwise
