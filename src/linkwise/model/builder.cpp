#include "linkwise/model/builder.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "linkwise/base/error.hpp"
#include "linkwise/model/joint_types.hpp"
#include "linkwise/model/validate.hpp"

namespace linkwise {
namespace {

using Values = std::optional<std::vector<double>>;

/// Takes what `name` is given out of the properties; nothing where it is not there.
Values take(Properties& properties, const std::string& name) {
  Values found;
  std::erase_if(properties, [&](auto& given) {
    if (given.first != name) return false;
    found = std::move(given.second);
    return true;
  });
  return found;
}

/// Puts the armature of a rotor behind its gear, g^2 J, in the place of these two.
void reflect_motor(Properties& properties) {
  const Values inertia = take(properties, "motor_inertia");
  const Values ratio = take(properties, "gear_ratio");
  if (ratio && !inertia)
    throw InputError(
        "gear_ratio is given without motor_inertia; give both, or armature = gear_ratio^2 "
        "motor_inertia (torques are those at the joint, behind the gear)");
  if (!inertia) return;
  for (const auto& [name, values] : properties)
    if (name == "armature" && values)
      throw InputError("both armature and motor_inertia are given; keep one");
  for (double J : *inertia)
    if (J < 0)
      throw InputError("motor_inertia is negative (" + number_text(J) + "); give a value >= 0");
  const std::vector<double> one{1.0};
  const std::vector<double>& g = ratio ? *ratio : one;
  for (double x : g)
    if (x == 0 || !std::isfinite(x))
      throw InputError("gear_ratio is " + number_text(x) + "; give a finite number other than 0");
  const size_t n = std::max(g.size(), inertia->size());
  if ((g.size() != 1 && g.size() != n) || (inertia->size() != 1 && inertia->size() != n))
    throw InputError("gear_ratio has " + std::to_string(g.size()) + " values and motor_inertia " +
                     std::to_string(inertia->size()) + "; give as many, or one");
  std::vector<double> armature(n);
  for (size_t i = 0; i < n; ++i) {
    const double gear = g[g.size() == 1 ? 0 : i];
    armature[i] = gear * gear * (*inertia)[inertia->size() == 1 ? 0 : i];
  }
  properties.emplace_back("armature", std::move(armature));
}

DofProperty property_from_name(const std::string& name) {
  std::vector<std::string> known{"motor_inertia", "gear_ratio"};
  for (const DofPropertyEntry& entry : dof_property_table) {
    if (name == entry.name) return dof_property_from_name(name);
    known.emplace_back(entry.name);
  }
  throw InputError("property '" + name + "' is unknown" + suggest(name, known));
}

}  // namespace

LinkSpec make_link(std::string name, double mass, const Vec3<double>& com,
                   const Mat3<double>& inertia) {
  const auto& I = inertia.m;
  double scale = 0;
  for (double x : I) scale = std::max(scale, std::abs(x));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < i; ++j)
      if (std::abs(I[3 * i + j] - I[3 * j + i]) > 1e-9 * scale)
        throw InputError("link '" + name +
                         "': inertia is not symmetric; give a symmetric 3x3 matrix");
  return {std::move(name), mass, com, {{I[0], I[3], I[4], I[6], I[7], I[8]}}};
}

AxisSpec make_axis(const std::string& kind, const Vec3<double>& axis, double pitch) {
  for (AxisKind k : {AxisKind::revolute, AxisKind::prismatic, AxisKind::helical})
    if (kind == axis_kind_name(k)) return {k, axis, pitch};
  throw InputError("axis kind '" + kind + "' is unknown; known: revolute, prismatic, helical");
}

void set_properties(JointSpec& joint, Properties properties) {
  reflect_motor(properties);
  for (auto& [name, values] : properties) {
    const DofProperty property = property_from_name(name);
    if (!values) continue;
    const auto had = std::find_if(joint.dof.begin(), joint.dof.end(), [&](const DofValue& value) {
      return value.property == property;
    });
    const double fallback = dof_property_table[static_cast<int>(property)].fallback;
    const bool usual = values->size() == 1 && values->front() == fallback;
    if (had != joint.dof.end() && usual)
      joint.dof.erase(had);
    else if (had != joint.dof.end())
      had->values = std::move(*values);
    else if (!usual)
      joint.dof.push_back({property, std::move(*values)});
  }
}

ModelBuilder::ModelBuilder(std::string name, const Vec3<double>& gravity, std::string source) {
  spec_.name = std::move(name);
  spec_.gravity = gravity;
  spec_.source = std::move(source);
}

void ModelBuilder::complete(JointSpec& joint, const std::string& type, double pitch,
                            Properties properties) const {
  try {
    joint.type = joint_type_from_name(type);
    set_properties(joint, std::move(properties));
  } catch (const InputError& error) {
    throw InputError("joint '" + joint.name + "'" + source_of(spec_) + ": " + error.what());
  }
  if (joint.axes.empty() && joint.type != JointType::composite) joint.axes.emplace_back();
  if (joint.type == JointType::helical) joint.axes[0].pitch = pitch;
}

void ModelBuilder::add_joint(JointSpec joint, const std::string& type, double pitch,
                             Properties properties) {
  complete(joint, type, pitch, std::move(properties));
  spec_.joints.push_back(std::move(joint));
}

void ModelBuilder::add_loop_joint(LoopJointSpec loop, const std::string& type, double pitch,
                                  Properties properties) {
  complete(loop.joint, type, pitch, std::move(properties));
  spec_.loop_joints.push_back(std::move(loop));
}

void ModelBuilder::add_rod(LoopJointSpec loop, double length) {
  if (!(length > 0))
    throw InputError("rod '" + loop.joint.name + "'" + source_of(spec_) + ": length is " +
                     number_text(length) + "; give the length of the rod in m, more than 0");
  loop.joint.type = JointType::fixed;
  loop.kind = LoopKind::rod;
  loop.length = length;
  spec_.loop_joints.push_back(std::move(loop));
}

void ModelBuilder::add_spring(LoopJointSpec loop, double length, Properties properties) {
  complete(loop.joint, "prismatic", 0, std::move(properties));
  loop.kind = LoopKind::spring;
  loop.length = length;
  spec_.loop_joints.push_back(std::move(loop));
}

void ModelBuilder::add_note(const std::string& level, std::string element, std::string text) {
  spec_.notes.push_back({note_level_from_name(level), std::move(element), std::move(text)});
}

void ModelBuilder::set_floating_base(std::string joint_name) {
  spec_.floating_base = true;
  spec_.floating_joint = std::move(joint_name);
}

ModelSpec ModelBuilder::spec(bool keep_fixed) const {
  ModelSpec spec = spec_;
  spec.keep_fixed = keep_fixed;
  if (flexible_.empty()) return spec;
  FlexibleLinks links(spec);
  for (const auto& any : flexible_)
    std::visit([&](const auto& flexible) { links.add(flexible); }, any);
  return spec;
}

ModelSpec make_chain(const EqualChain& chain) {
  ModelSpec spec;
  spec.name = "chain";
  spec.gravity = chain.gravity;
  spec.floating_base = chain.floating_base;
  spec.links.reserve(chain.n_links + 1);
  spec.joints.reserve(chain.n_links);
  if (!chain.floating_base) spec.links.push_back({"ground", 0, {}, {}});
  LinkSpec link = chain.link;
  JointSpec joint;
  joint.type = chain.joint;
  if (chain.damping != 0) joint.dof.push_back({DofProperty::damping, {chain.damping}});
  if (chain.armature != 0) joint.dof.push_back({DofProperty::armature, {chain.armature}});
  for (size_t i = 0; i < chain.n_links; ++i) {
    link.name = "link_" + std::to_string(i + 1);
    spec.links.push_back(link);
    if (chain.floating_base && i == 0) continue;
    joint.name = "joint_" + std::to_string(i + 1);
    joint.parent = spec.links[spec.links.size() - 2].name;
    joint.child = link.name;
    joint.translation = i == 0 ? Vec3<double>{} : chain.translation;
    joint.axes.clear();
    for (int k = 0; k < std::max(1, info_of(chain.joint).n_axes); ++k)
      joint.axes.push_back({AxisKind::revolute, chain.axes[(i + k) % chain.axes.size()], 0});
    spec.joints.push_back(joint);
  }
  return spec;
}

ModelSpec with_joints(ModelSpec spec,
                      std::vector<std::pair<std::string, Properties>> properties_of) {
  std::unordered_map<std::string, JointSpec*> by_name;
  for (JointSpec& joint : spec.joints) by_name.emplace(joint.name, &joint);
  for (LoopJointSpec& loop : spec.loop_joints) by_name.emplace(loop.joint.name, &loop.joint);
  for (auto& [name, properties] : properties_of) {
    const std::string head = "joint '" + name + "'" + source_of(spec) + ": ";
    const auto found = by_name.find(name);
    if (found == by_name.end())
      throw InputError(head +
                       "is the floating base, which has no properties; let the root link hang on a "
                       "floating joint of the machine instead");
    try {
      set_properties(*found->second, std::move(properties));
    } catch (const InputError& error) {
      throw InputError(head + error.what());
    }
  }
  return spec;
}

ModelSpec with_more_freedom(ModelSpec spec, const std::string& joint, JointType type) {
  const std::string head = "joint '" + joint + "'" + source_of(spec) + ": ";
  JointSpec* found = nullptr;
  for (JointSpec& one : spec.joints)
    if (one.name == joint) found = &one;
  for (LoopJointSpec& loop : spec.loop_joints)
    if (loop.joint.name == joint && loop.kind == LoopKind::joint) found = &loop.joint;
  if (!found) throw InputError(head + "is no joint of the machine; name one of its joints");
  const bool turns = found->type == JointType::revolute || found->type == JointType::continuous,
             slides = found->type == JointType::prismatic;
  const bool fits =
      type == JointType::cylindrical ? turns || slides : type == JointType::spherical && turns;
  if (!fits)
    throw InputError(head + "a " + joint_type_name(found->type) + " joint cannot become " +
                     joint_type_name(type) +
                     "; hinges may become cylindrical or spherical, sliders cylindrical");
  const double at = found->initial.empty() ? 0 : found->initial[0];
  found->type = type;
  if (type == JointType::spherical) {
    const Vec3<double> axis =
        (std::sin(at / 2) / std::sqrt(dot(found->axes[0].axis, found->axes[0].axis))) *
        found->axes[0].axis;
    if (at != 0) found->initial = {axis.x, axis.y, axis.z, std::cos(at / 2)};
    found->dof.clear();
    found->axes.clear();
    return spec;
  }
  if (!found->initial.empty())
    found->initial = turns ? std::vector<double>{0, at} : std::vector<double>{at, 0};
  for (DofValue& value : found->dof) {
    const double free = dof_property_table[static_cast<int>(value.property)].fallback;
    value.values.resize(1);
    value.values.insert(turns ? value.values.begin() : value.values.end(), free);
  }
  return spec;
}

ModelSpec with_payload(ModelSpec spec, const std::string& link, LinkSpec payload) {
  JointSpec weld;
  weld.name = payload.name + "_mount";
  weld.type = JointType::fixed;
  weld.parent = link;
  weld.child = payload.name;
  spec.links.push_back(std::move(payload));
  spec.joints.push_back(std::move(weld));
  return spec;
}

}  // namespace linkwise
