#pragma once
// Machines to test on: every joint type alone and in chains, mixed chains of awkward sizes, random
// trees, hubs, and every special case of a model (armature, prescribed, welded, kept fixed,
// massless, floating).

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/draws.hpp"
#include "linkwise/model/model.hpp"
#include "linkwise/simd/lanes.hpp"
#include "spatial/dense6.hpp"

namespace linkwise::testing {

constexpr JointType all_joint_types[] = {
    JointType::fixed,   JointType::revolute,    JointType::continuous, JointType::prismatic,
    JointType::helical, JointType::cylindrical, JointType::universal,  JointType::spherical,
    JointType::planar,  JointType::floating,    JointType::composite};

inline LinkSpec random_link(std::string name, Draws& draws) {
  return {std::move(name), draws.uniform(0.5, 3), random_vector3(draws, 0.3),
          random_central_inertia(draws, 0.3)};
}

/// Random placement, axes of any direction and length.
inline JointSpec random_joint(JointType type, std::string name, std::string parent,
                              std::string child, Draws& draws) {
  JointSpec j;
  j.name = std::move(name);
  j.type = type;
  j.parent = std::move(parent);
  j.child = std::move(child);
  j.rotation = random_rotation(draws);
  j.translation = random_vector3(draws, 0.5);
  const AxisKind kinds[] = {AxisKind::helical, AxisKind::prismatic, AxisKind::revolute};
  for (AxisKind kind : kinds) j.axes.push_back({kind, random_vector3(draws), draws.normal() / 5});
  return j;
}

/// Link i + 1 hangs by joint i on link parents[i] + 1; link 0 is the root.
inline ModelSpec tree_spec(const std::vector<JointType>& types, const std::vector<int>& parents,
                           Draws& draws) {
  ModelSpec spec;
  spec.gravity = {1.5, -2, -9.3};
  spec.links.push_back(random_link("base", draws));
  for (size_t i = 0; i < types.size(); ++i) {
    const std::string number = std::to_string(i);
    spec.links.push_back(random_link("link" + number, draws));
    spec.joints.push_back(random_joint(types[i], "joint" + number, spec.links[parents[i] + 1].name,
                                       "link" + number, draws));
  }
  return spec;
}

inline std::vector<int> chain_parents(int n) {
  std::vector<int> parents(n);
  for (int i = 0; i < n; ++i) parents[i] = i - 1;
  return parents;
}
inline std::vector<int> random_parents(int n, Draws& draws) {
  std::vector<int> parents(n);
  for (int i = 0; i < n; ++i) parents[i] = draws.below(i + 1) - 1;
  return parents;
}
inline std::vector<JointType> random_types(int n, Draws& draws) {
  std::vector<JointType> types(n);
  for (JointType& t : types) t = all_joint_types[draws.below(std::size(all_joint_types))];
  return types;
}

inline void make_massless(LinkSpec& link) {
  link.mass = 0;
  link.com = {};
  link.inertia = {};
}

struct Machine {
  std::string name;
  ModelSpec spec;
  /// No massless link that carries several joints: every method takes it.
  bool regular = true;
};
inline void PrintTo(const Machine& machine, std::ostream* out) { *out << machine.name; }

/// Hinges on axes that are parallel, nearly parallel, coincident, or meet in a point: the common
/// normals that frames are put on are degenerate or far away. Two children on every second body.
inline std::vector<Machine> axis_geometries(Draws& draws) {
  struct Geometry {
    const char* name;
    double tilt;          ///< of each axis against the one before, about x, rad
    Vec3<double> offset;  ///< of each joint from the one before
  };
  const Geometry geometries[] = {
      {"parallel_planar", 0, {0.7, 0, 0}},
      {"parallel_stepped", 0, {0.3, -0.2, 0.5}},
      {"coincident", 0, {0, 0, 0.4}},
      {"at_one_point", 0.8, {0, 0, 0}},
      {"crossing", std::numbers::pi / 2, {0, 0, 0.6}},
      {"antiparallel", std::numbers::pi, {0.5, 0, 0.1}},
      {"nearly_parallel_1e-13", 1e-13, {0.5, 0.3, 0}},
      {"nearly_parallel_1e-9", 1e-9, {0.5, 0.3, 0.2}},
      {"nearly_parallel_1e-3", 1e-3, {0.5, 0.3, 0}},
      {"nearly_parallel_0.1", 0.1, {0.5, 0.3, 0.2}},
  };
  std::vector<Machine> all;
  for (const Geometry& g : geometries) {
    ModelSpec spec = tree_spec(std::vector(7, JointType::revolute), {-1, 0, 1, 1, 2, 4, 4}, draws);
    for (JointSpec& j : spec.joints) {
      const double c = std::cos(g.tilt), s = std::sin(g.tilt);
      j.rotation = {{1, 0, 0, 0, c, -s, 0, s, c}};
      j.translation = g.offset;
      j.axes[0].axis = {0, 0, 1};
    }
    std::string name = g.name;
    for (char& letter : name)
      if (letter == '.' || letter == '-') letter = '_';
    all.push_back({name, spec});
  }
  return all;
}

/// Two or three massless links in a row between bodies, at most 6 degrees of freedom per stack; a
/// side branch on the body in the middle.
inline ModelSpec stacked_spec(Draws& draws) {
  using enum JointType;
  ModelSpec spec =
      tree_spec({revolute, prismatic, helical, universal, spherical, fixed, composite, revolute},
                {-1, 0, 1, 2, 3, 4, 5, 3}, draws);
  for (int massless : {1, 2, 5, 6}) make_massless(spec.links[massless]);
  return spec;
}

/// Two hinges and point masses: the outer one has no inertia about its axis.
inline ModelSpec singular_spec() {
  ModelSpec spec;
  spec.links = {{"base", 0, {}, {}}, {"arm", 1, {0.5, 0, 0}, {}}, {"tip", 1, {0, 0, 0}, {}}};
  Draws draws(1);
  for (int i = 0; i < 2; ++i)
    spec.joints.push_back(random_joint(JointType::revolute, "hinge" + std::to_string(i),
                                       spec.links[i].name, spec.links[i + 1].name, draws));
  return spec;
}

inline std::vector<Machine> special_machines(Draws& draws) {
  using enum JointType;
  const std::vector<JointType> mixed{revolute, universal, spherical, prismatic, composite,
                                     planar,   helical,   revolute,  floating,  cylindrical};
  const std::vector<int> branched{-1, 0, 1, 1, 3, 0, 5, 5, 5, 8};
  const auto make = [&] { return tree_spec(mixed, branched, draws); };
  std::vector<Machine> all;

  ModelSpec armature = make();
  for (size_t i : {0, 1, 4, 5, 7}) {
    JointSpec& j = armature.joints[i];
    std::vector<double> values(joint_dof(j) == 1 ? 1 : 0);
    for (double& x : values) x = draws.uniform(0.01, 2);
    if (values.empty()) values = {0.3};
    j.dof.push_back({DofProperty::armature, values});
  }
  armature.joints[2].dof.push_back({DofProperty::armature, {0.4, 0, 0.9}});
  all.push_back({"armature", armature});

  ModelSpec prescribed = make();
  prescribed.prescribed = {"joint1", "joint3", "joint4", "joint9"};
  all.push_back({"prescribed", prescribed});
  prescribed.joints[0].dof.push_back({DofProperty::armature, {0.5}});
  prescribed.joints[4].dof.push_back({DofProperty::armature, {0.5}});
  prescribed.prescribed = {"joint0", "joint4", "joint8"};
  all.push_back({"prescribed_armature", prescribed});
  prescribed.prescribed.clear();
  for (const JointSpec& j : prescribed.joints) prescribed.prescribed.push_back(j.name);
  all.push_back({"all_prescribed", prescribed});

  ModelSpec welded = tree_spec({fixed, revolute, fixed, fixed, spherical, fixed, prismatic, fixed},
                               {-1, 0, 1, 2, 3, 1, 4, 6}, draws);
  make_massless(welded.links[3]);
  make_massless(welded.links[8]);
  all.push_back({"welded", welded});
  welded.keep_fixed = true;
  all.push_back({"kept_fixed", welded});
  welded.floating_base = true;
  all.push_back({"kept_fixed_floating", welded});

  ModelSpec stacked = stacked_spec(draws);
  all.push_back({"stacked", stacked});
  stacked.prescribed = {"joint1"};
  all.push_back({"stacked_prescribed", stacked});
  stacked.keep_fixed = true;
  stacked.joints[0].dof.push_back({DofProperty::armature, {0.2}});
  stacked.joints[2].dof.push_back({DofProperty::armature, {0.7}});
  all.push_back({"stacked_armature_floating", stacked});
  all.back().spec.floating_base = true;

  ModelSpec hub = tree_spec({revolute, revolute, spherical, prismatic}, {-1, 0, 0, 0}, draws);
  make_massless(hub.links[1]);
  all.push_back({"massless_hub", hub, false});

  ModelSpec point_mass = tree_spec({revolute, universal}, {-1, 0}, draws);
  point_mass.links[1].inertia = {};
  all.push_back({"point_mass", point_mass, false});
  return all;
}

inline std::vector<Machine> all_machines() {
  std::vector<Machine> all;
  std::uint64_t seed = 1;
  for (JointType type : all_joint_types)
    for (int n : {1, 4}) {
      Draws draws(seed++);
      ModelSpec spec = tree_spec(std::vector(n, type), chain_parents(n), draws);
      spec.keep_fixed = true;
      all.push_back({std::string(joint_type_name(type)) + "_" + std::to_string(n), spec});
    }
  {
    Draws draws(seed++);
    all.push_back(
        {"revolute_40", tree_spec(std::vector(40, JointType::revolute), chain_parents(40), draws)});
  }
  const std::set<int> sizes{
      1, 2, 3, 7, std::max(1, native_lanes - 1), native_lanes, native_lanes + 1};
  for (int n : sizes)
    for (bool floating : {false, true}) {
      Draws draws(seed++);
      ModelSpec spec = tree_spec(random_types(n, draws), chain_parents(n), draws);
      spec.floating_base = floating;
      all.push_back({"chain_" + std::to_string(n) + (floating ? "_floating" : ""), spec});
    }
  for (int i = 0; i < 12; ++i) {
    Draws draws(seed++);
    const int n = 3 + draws.below(12);
    ModelSpec spec = tree_spec(random_types(n, draws), random_parents(n, draws), draws);
    spec.floating_base = i % 2;
    spec.keep_fixed = i % 3 == 0;
    all.push_back({"tree_" + std::to_string(i), spec});
  }
  for (bool floating : {false, true}) {
    Draws draws(seed++);
    std::vector<int> parents(50, floating ? -1 : 0);
    parents[0] = -1;
    ModelSpec spec = tree_spec(random_types(50, draws), parents, draws);
    spec.floating_base = floating;
    all.push_back({floating ? "hub_50_floating" : "hub_50", spec});
  }
  Draws draws(seed++);
  for (Machine& machine : axis_geometries(draws)) all.push_back(std::move(machine));
  for (Machine& machine : special_machines(draws)) all.push_back(std::move(machine));
  return all;
}

/// Joints of one axis in chains, trees and on one body, every second pair with a rotor; left-handed
/// and right-handed screws, and one that does not advance.
inline std::vector<Machine> one_axis_machines() {
  using enum JointType;
  std::vector<Machine> all;
  Draws draws(81);
  const auto add = [&](const std::string& name, const std::vector<JointType>& kinds, int n,
                       const std::vector<int>& parents) {
    std::vector<JointType> types(n);
    for (int i = 0; i < n; ++i) types[i] = kinds[i % kinds.size()];
    ModelSpec spec = tree_spec(types, parents, draws);
    if (kinds[0] == helical) spec.joints.back().axes[0].pitch = 0;
    all.push_back({name, spec});
    for (int i = 0; i < n; ++i)
      if (i % 4 < 2) spec.joints[i].dof.push_back({DofProperty::armature, {0.1 + 0.2 * i}});
    all.push_back({name + "_geared", spec});
    spec.floating_base = true;
    all.push_back({name + "_floating", spec});
  };
  const std::vector<JointType> mixed{helical, prismatic, revolute, prismatic, helical};
  for (const auto& [name, kinds] : {std::pair{"slides", std::vector{prismatic}},
                                    {"screws", std::vector{helical}},
                                    {"mixed_axes", mixed}}) {
    add(std::string(name) + "_chain", kinds, 11, chain_parents(11));
    add(std::string(name) + "_tree", kinds, 14, random_parents(14, draws));
    add(std::string(name) + "_on_one_body", kinds, 7, {-1, 0, 0, 0, 0, 0, 0});
  }
  return all;
}

/// Any q, quaternions of length other than 1 among them; and any v.
struct MachineState {
  std::vector<double> q, v;
};
inline MachineState random_state(const Model& model, Draws& draws) {
  MachineState state;
  for (int i = 0; i < model.nq(); ++i) state.q.push_back(draws.uniform(-1.5, 1.5));
  for (int i = 0; i < model.nv(); ++i) state.v.push_back(draws.normal());
  return state;
}
inline std::vector<double> random_values(int n, Draws& draws, double size = 1) {
  std::vector<double> out(n);
  for (double& x : out) x = size * draws.normal();
  return out;
}

/// Those whose bodies all have an inertia to invert.
inline std::vector<Machine> regular_machines() {
  std::vector<Machine> all;
  for (const Machine& machine : all_machines())
    if (machine.regular) all.push_back(machine);
  return all;
}

}  // namespace linkwise::testing
