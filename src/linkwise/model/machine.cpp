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
  names.reset(spec.joints.size());
  for (size_t i = 0; i < spec.joints.size(); ++i)
    if (!names.insert(
            static_cast<int>(i), [&](int k) -> const auto& { return spec.joints[k].name; }))
      throw InputError("joint '" + spec.joints[i].name + "'" + where +
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
  for (const auto& joint : graph.joints) parents[joint.child].push_back(joint.parent);
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
  for (const auto& joint : graph.joints) is_child[joint.child] = 1;
  const auto root = std::find(is_child.begin(), is_child.end(), 0);
  return root == is_child.end() ? 0 : static_cast<int>(root - is_child.begin());
}

void add_floating_base(Machine& machine) {
  const ModelSpec& spec = machine.spec;
  for (const JointSpec& j : spec.joints)
    if (j.name == spec.floating_joint)
      throw InputError("joint '" + j.name + "'" + machine.where +
                       ": the floating base needs this name; rename the joint");
  MachineGraph& graph = machine.graph;
  machine.floating_joint.name = spec.floating_joint;
  machine.floating_joint.type = JointType::floating;
  machine.floating_joint.child = machine.link_name(graph.ground);
  const int root = graph.ground;
  graph.ground = graph.n_links();
  graph.massless.push_back(1);
  graph.joints.push_back({graph.ground, root, joint_dof(machine.floating_joint)});
}

[[noreturn]] void refuse_loop(const Machine& machine, const std::vector<int>& loop,
                              const JointSpec& closing) {
  const std::string head = "joint '" + closing.name + "'" + machine.where;
  if (closing.parent == closing.child)
    throw InputError(head + ": link '" + closing.child +
                     "' is its parent and its child; give it two links");
  const size_t shown = std::min<size_t>(loop.size(), 8);
  std::string names;
  for (size_t i = 0; i < shown; ++i) {
    if (i > 0) names += i + 1 < loop.size() ? ", " : " and ";
    names += "'" + machine.joint(loop[i]).name + "'";
  }
  if (shown < loop.size()) names += " ...";
  throw InputError(head + " closes a loop of joints " + names + " at link '" + closing.child +
                   "'; a model is a tree: remove one of these joints");
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
  graph.joints.reserve(spec.joints.size() + 1);
  for (const JointSpec& j : spec.joints) {
    const int parent = find_link(spec, links, j.parent, j, "parent", where);
    const int child = find_link(spec, links, j.child, j, "child", where);
    graph.joints.push_back({parent, child, joint_dof(j), acts(j), j.type == JointType::fixed});
  }
  if (spec.keep_fixed) {
    const std::vector<char> carries = links_that_carry(graph);
    for (auto& joint : graph.joints) joint.weld = joint.weld && !carries[joint.child];
  }
  machine.prescribed.assign(spec.joints.size() + 1, 0);
  for (const std::string& name : spec.prescribed) {
    const int j = names.find(
        name, [&](int k) -> const auto& { return spec.joints[k].name; });
    if (j >= 0) graph.joints[j].acts = true;
    if (j >= 0 || (spec.floating_base && name == spec.floating_joint))
      machine.prescribed[j >= 0 ? j : spec.joints.size()] = 1;
  }
  graph.ground = root_link(graph);
  if (spec.floating_base) add_floating_base(machine);
  return machine;
}

void require_tree(const Machine& machine, const SpanningForest& forest) {
  const MachineGraph& graph = machine.graph;
  std::vector<int> root_of(graph.n_links());
  for (int root : forest.roots) root_of[root] = root;
  for (int j : forest.order) root_of[graph.joints[j].child] = root_of[graph.joints[j].parent];
  for (int j : forest.loop_joints)
    if (root_of[graph.joints[j].parent] == root_of[graph.joints[j].child])
      refuse_loop(machine, loop_of(graph, forest, j), machine.joint(j));
  if (forest.roots.size() == 1) return;
  const int first = graph.ground < machine.n_links() ? graph.ground : graph.joints.back().child;
  throw InputError("links '" + machine.link_name(first) + "' and '" +
                   machine.link_name(forest.roots[1]) + "'" + machine.where +
                   " both have no parent; a model has one root: join them with a joint");
}

}  // namespace linkwise
