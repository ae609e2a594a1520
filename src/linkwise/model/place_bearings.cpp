#include "linkwise/model/place_bearings.hpp"

#include <cmath>
#include <set>

#include "linkwise/base/error.hpp"
#include "linkwise/base/finite.hpp"
#include "linkwise/model/validate.hpp"

namespace linkwise {
namespace {

struct Direction {
  const char* name;
  double BearingSpec::*stiffness;
  const char* unit;
  const char* moves;  ///< what a joint does that is free in it
};
constexpr Direction directions[] = {
    {"radial", &BearingSpec::radial, "N/m", "slides across its axis"},
    {"axial", &BearingSpec::axial, "N/m", "slides along its axis"},
    {"tilt", &BearingSpec::tilt, "N m/rad", "tilts"},
    {"torsion", &BearingSpec::torsion, "N m/rad", "turns about its axis"},
};

/// Whether a joint of this type moves in the direction without any load.
bool is_free(JointType type, int direction) {
  switch (type) {
    case JointType::revolute:
    case JointType::continuous:
      return direction == 3;
    case JointType::prismatic:
      return direction == 1;
    case JointType::cylindrical:
      return direction == 1 || direction == 3;
    case JointType::spherical:
      return direction >= 2;
    case JointType::planar:
      return direction == 0 || direction == 3;
    case JointType::floating:
      return true;
    default:
      return false;
  }
}

bool has_one_axis(JointType type) { return info_of(type).n_axes == 1; }

LoopKind kind_of(const Model& model, int load) {
  return load < model.n_joints() ? LoopKind::joint
                                 : model.loops.joints[load - model.n_joints()].kind;
}

void check_stiffness(const BearingSpec& given, const std::string& head) {
  bool any = given.has_misfit();
  for (const Direction& direction : directions) {
    const double k = given.*direction.stiffness;
    if (!(k > 0))
      throw InputError(head + direction.name + " is " + number_text(k) +
                       "; give a stiffness above 0 in " + direction.unit +
                       ", or leave it out where the bearing is rigid");
    any |= std::isfinite(k);
  }
  if (!any)
    throw InputError(head +
                     "has no stiffness; give radial, axial, tilt or torsion, or leave it out");
}

void check_misfit(const BearingSpec& given, const std::string& head) {
  const std::pair<const char*, const Vec3<double>*> all[] = {
      {"offset", &given.offset}, {"turn", &given.turn}, {"preload", &given.preload}};
  for (const auto& [name, value] : all)
    if (!all_finite({&value->x, 3}))
      throw InputError(head + name + " is not finite; give finite numbers");
  if (!std::isfinite(given.offset_along) || !std::isfinite(given.preload_along))
    throw InputError(head + (std::isfinite(given.preload_along) ? "offset" : "preload") +
                     " is not finite; give finite numbers");
}

/// A preload is one against a stiffness.
void check_preload(const Bearing& bearing, const JointSpec& joint, const std::string& head) {
  constexpr double rounding = 1e-12;
  const Vec3<double>& P = bearing.preload;
  const double along = dot(P, bearing.axis), size = std::sqrt(dot(P, P)),
               across = std::sqrt(std::max(0.0, size * size - along * along));
  const std::pair<double, double> parts[] = {{across, bearing.across},
                                             {std::abs(along), bearing.along}};
  for (int d = 0; d < 2; ++d) {
    if (!(parts[d].first > rounding * size) || parts[d].second > 0) continue;
    const std::string name = directions[d].name;
    throw InputError(head + (is_free(joint.type, d)
                                 ? "a " + std::string(joint_type_name(joint.type)) + " joint " +
                                       directions[d].moves +
                                       " freely and holds no preload; remove "
                                       "that part of preload"
                                 : "preload acts against the stiffness " + name +
                                       ", which is not given; give " + name + ", or offset"));
  }
}

/// A rod yields along itself, whatever its direction: to all forces alike.
Bearing place_on_rod(const BearingSpec& given, int load, const std::string& head) {
  for (const Direction& direction : directions)
    if (std::isfinite(given.*direction.stiffness) && direction.stiffness != &BearingSpec::axial)
      throw InputError(head + "is a rod, which carries a force along itself alone; remove " +
                       direction.name + ", and give axial");
  if (dot(given.offset, given.offset) + dot(given.turn, given.turn) +
          dot(given.preload, given.preload) >
      0)
    throw InputError(head +
                     "is a rod, which fits or not along itself alone; give offset and preload as "
                     "one number each, and no turn");
  if (given.preload_along != 0 && !std::isfinite(given.axial))
    throw InputError(head +
                     "preload acts against the stiffness axial, which is not given; give axial, or "
                     "offset");
  Bearing rod{load, {0, 0, 1}, 1 / given.axial, 1 / given.axial, 0, 0};
  rod.offset = {0, 0, given.offset_along};
  rod.preload = {0, 0, given.preload_along};
  rod.has_misfit = given.has_misfit();
  return rod;
}

/// Its own, or the joint's.
Vec3<double> axis_of(const BearingSpec& given, const JointSpec& joint, const std::string& head) {
  const bool own = has_one_axis(joint.type);
  Vec3<double> axis = given.axis;
  if (!all_finite({&axis.x, 3}))
    throw InputError(head + "axis is not finite; give three finite numbers");
  const double length = std::sqrt(dot(axis, axis));
  if (length > 0 && own)
    throw InputError(head + "axis is that of the " + joint_type_name(joint.type) +
                     " joint; remove it");
  if (length > 0) return (1 / length) * axis;
  if (own) return joint.axes[0].axis;
  const bool along = given.offset_along != 0 || given.preload_along != 0;
  if (along || given.radial != given.axial || given.tilt != given.torsion)
    throw InputError(head + "a " + joint_type_name(joint.type) +
                     " joint has no axis of its own; give axis = [x, y, z] in its frame, or " +
                     (along ? "offset and preload as three numbers each"
                            : "radial equal to axial and tilt to torsion"));
  return {0, 0, 1};
}

Bearing place(const Model& model, const BearingSpec& given, const std::string& head) {
  int load = -1;
  try {
    load = model.load_index(given.joint);
  } catch (const InputError& error) {
    throw InputError("bearing: " + std::string(error.what()));
  }
  check_stiffness(given, head);
  check_misfit(given, head);
  const LoopKind kind = kind_of(model, load);
  if (kind == LoopKind::spring)
    throw InputError(head + "is a spring, which has a stiffness of its own; remove the bearing");
  if (kind == LoopKind::rod) return place_on_rod(given, load, head);
  const JointSpec& joint = model.spec_of(model.joint_at(load));
  if (joint.type == JointType::floating)
    throw InputError(head + "is floating and holds nothing; remove the bearing");
  for (int d = 0; d < 4; ++d)
    if (std::isfinite(given.*directions[d].stiffness) && is_free(joint.type, d))
      throw InputError(head + "a " + joint_type_name(joint.type) + " joint " + directions[d].moves +
                       " freely; remove " + directions[d].name);
  if (given.offset_along != 0 && is_free(joint.type, 1))
    throw InputError(head + "a " + joint_type_name(joint.type) + " joint " + directions[1].moves +
                     " freely; remove offset");
  Bearing out{load,
              axis_of(given, joint, head),
              1 / given.radial,
              1 / given.axial,
              1 / given.tilt,
              1 / given.torsion};
  out.offset = given.offset + given.offset_along * out.axis;
  out.turn = given.turn;
  out.preload = given.preload + given.preload_along * out.axis;
  out.has_misfit = given.has_misfit();
  check_preload(out, joint, head);
  return out;
}

}  // namespace

std::vector<Bearing> place_bearings(const Model& model, std::vector<Note>& notes) {
  std::vector<Bearing> out;
  std::set<std::string> joints;
  for (const BearingSpec& given : model.spec().bearings) {
    const std::string head = "bearing of joint '" + given.joint + "'" + model.where() + ": ";
    if (!joints.insert(given.joint).second) throw InputError(head + "is given twice; keep one");
    out.push_back(place(model, given, head));
    if (!model.is_constrained())
      notes.push_back({NoteLevel::warning, given.joint,
                       "its bearing has no effect: no loop is closed, and rigid bodies determine "
                       "all loads"});
  }
  return out;
}

}  // namespace linkwise
