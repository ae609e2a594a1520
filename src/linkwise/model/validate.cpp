#include "linkwise/model/validate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "linkwise/base/error.hpp"
#include "linkwise/model/joint_types.hpp"

namespace linkwise {
namespace {

bool finite(const Vec3<double>& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// As many finite coordinates as the joint has, or none; quaternions are brought to length 1.
void validate_initial(JointSpec& joint, const std::string& head) {
  if (joint.initial.empty()) return;
  int nq = 0;
  for (int k = 0; k < n_joint_elements(joint); ++k) nq += element_size(joint, k).nq;
  if (joint.initial.size() != static_cast<size_t>(nq))
    throw InputError(head + "initial has " + std::to_string(joint.initial.size()) +
                     " numbers; give its " + std::to_string(nq) + " coordinates");
  for (double x : joint.initial)
    if (!std::isfinite(x))
      throw InputError(head + "initial is not finite; give finite coordinates");
  double* q = joint.initial.data();
  for (int k = 0; k < n_joint_elements(joint); ++k) {
    const auto& info = info_of(joint_element(joint, k).kind);
    if (info.quaternion >= 0) {
      double* c = q + info.quaternion;
      const double length = std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2] + c[3] * c[3]);
      if (std::abs(length - 1) > 1e-3)
        throw InputError(head + "initial has a quaternion of length " + number_text(length) +
                         "; give a unit quaternion x y z w");
      if (std::abs(length - 1) > 1e-15)
        for (int i = 0; i < 4; ++i) c[i] /= length;
    }
    q += info.nq;
  }
}

int edit_distance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = static_cast<int>(j);
  for (size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const int above = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1])});
      diagonal = above;
    }
  }
  return row[b.size()];
}

}  // namespace

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

void principal_moments(const Sym3<double>& I, double out[3]) {
  // Trigonometric solution of the characteristic cubic on the scaled matrix.
  const double scale = std::max({std::abs(I.m[0]), std::abs(I.m[1]), std::abs(I.m[2]),
                                 std::abs(I.m[3]), std::abs(I.m[4]), std::abs(I.m[5])});
  if (scale == 0) {
    out[0] = out[1] = out[2] = 0;
    return;
  }
  const double a = I.m[0] / scale, b = I.m[1] / scale, c = I.m[2] / scale, d = I.m[3] / scale,
               e = I.m[4] / scale, f = I.m[5] / scale;
  const double mean = (a + c + f) / 3, off = b * b + d * d + e * e;
  const double p = std::sqrt(
      ((a - mean) * (a - mean) + (c - mean) * (c - mean) + (f - mean) * (f - mean) + 2 * off) / 6);
  if (p < 1e-300) {
    out[0] = out[1] = out[2] = mean * scale;
    return;
  }
  const double aa = (a - mean) / p, cc = (c - mean) / p, ff = (f - mean) / p, bb = b / p,
               dd = d / p, ee = e / p;
  const double det = aa * (cc * ff - ee * ee) - bb * (bb * ff - ee * dd) + dd * (bb * ee - cc * dd);
  const double angle = std::acos(std::clamp(det / 2, -1.0, 1.0)) / 3;
  const double largest = mean + 2 * p * std::cos(angle);
  const double smallest = mean + 2 * p * std::cos(angle + 2 * std::numbers::pi / 3);
  out[0] = smallest * scale;
  out[1] = (3 * mean - largest - smallest) * scale;
  out[2] = largest * scale;
}

bool clearly_negative(double mass, const double principal[3]) {
  // CAD programs print noise such as -1e-20 kg m2. Nobody means an inertia with a radius of
  // gyration below a micrometre.
  return principal[0] < -std::max(1e-6 * principal[2], 1e-12 * mass);
}

namespace {

/// Of an elastic link that carries others on its port; 0: of no such link.
int count_coordinates(const LinkSpec& link) {
  return BodyKinds::dispatch(link.body_kind, [&](auto kind) {
    using B = typename decltype(kind)::Body;
    if constexpr (has_coordinates<B>) return B::port_coordinates(link.parameters);
    return 0;
  });
}

struct Coordinates {
  BodyKind kind;
  int n;  ///< 0 once the link has its elastic joint
};

/// Elastic joints and elastic links belong to each other, one to one.
void validate_ports(ModelSpec& spec, const std::string& where) {
  std::unordered_map<std::string, Coordinates> coordinates;  // of elastic links
  for (const LinkSpec& link : spec.links)
    if (const int n = count_coordinates(link)) coordinates[link.name] = {link.body_kind, n};
  for (JointSpec& joint : spec.joints) {
    const auto parent = coordinates.find(joint.parent);
    const bool on_elastic = parent != coordinates.end();
    const std::string head = "joint '" + joint.name + "'" + where + ": ";
    if (joint.type != JointType::elastic) {
      if (on_elastic)
        throw InputError(head + "link '" + joint.parent +
                         "' is elastic; let the joint hang on the link at its end");
      continue;
    }
    if (!on_elastic)
      throw InputError(head + "is elastic, but link '" + joint.parent +
                       "' is rigid; make that link flexible, or the joint fixed");
    if (parent->second.n == 0)
      throw InputError(head + "link '" + joint.parent + "' has an elastic joint already; keep one");
    if (!joint.dof.empty())
      throw InputError(head + "is elastic and has no properties of its own; give the link's");
    joint.n_coordinates = std::exchange(parent->second.n, 0);
    joint.parent_kind = parent->second.kind;
  }
  for (const LinkSpec& link : spec.links)
    if (const auto at = coordinates.find(link.name); at != coordinates.end() && at->second.n > 0)
      throw InputError("link '" + link.name + "'" + where +
                       ": is elastic, and no elastic joint is on it; add one, to the link at its "
                       "end");
  for (const LoopJointSpec& loop : spec.loop_joints)
    for (const bool parent : {true, false}) {
      const std::string& name = parent ? loop.joint.parent : loop.joint.child;
      const Vec3<double>& at = parent ? loop.joint.translation : loop.child_translation;
      if (coordinates.count(name) && !(dot(at, at) <= 1e-18))
        throw InputError("joint '" + loop.joint.name + "'" + where + ": link '" + name +
                         "' is elastic; let the joint be where it starts, or on the link at its "
                         "end");
    }
}

}  // namespace

void validate(ModelSpec& spec, std::vector<Note>& notes) {
  const std::string where = source_of(spec);
  if (spec.links.empty())
    throw InputError("model '" + spec.name + "'" + where + " has no links; add at least one");
  if (!finite(spec.gravity))
    throw InputError("model '" + spec.name + "'" + where +
                     ": gravity is not finite; give three finite numbers in m/s2");
  for (const LinkSpec& link : spec.links) validate_link(link, where, notes);
  validate_ports(spec, where);
  for (JointSpec& joint : spec.joints) {
    validate_joint(joint, where);
    note_idle(joint, notes);
  }
  for (LoopJointSpec& loop : spec.loop_joints) {
    validate_joint(loop.joint, where);
    note_idle(loop.joint, notes);
    if (loop.kind == LoopKind::spring) note_idle_limits(loop.joint, notes);
    const std::string head = "joint '" + loop.joint.name + "'" + where + ": ";
    if (!finite(loop.child_translation))
      throw InputError(head + "child_translation is not finite; give three finite numbers in m");
    require_rotation(loop.child_rotation, head + "child_rotation");
    const bool rod = loop.kind == LoopKind::rod;
    if (!std::isfinite(loop.length) || loop.length < 0 || (rod && loop.length == 0))
      throw InputError(head + "length is " + number_text(loop.length) +
                       "; give the length of the " +
                       (rod ? "rod in m, more than 0" : "spring in m, 0 or more"));
    if (loop.kind != LoopKind::spring) continue;
    for (const DofValue& given : loop.joint.dof)
      if (given.property == DofProperty::armature)
        throw InputError(head + "a spring has no armature; give it to a joint");
  }
}

namespace {

/// A property that does nothing without another one.
struct Dependent {
  DofProperty property, needed;
};
constexpr Dependent dependents[] = {
    {DofProperty::limit_damping, DofProperty::limit_stiffness},
    {DofProperty::friction_velocity, DofProperty::friction},
    {DofProperty::rest_position, DofProperty::stiffness},
};

/// Of degree of freedom i.
double value_of(const JointSpec& joint, DofProperty property, size_t i) {
  double value = dof_property_table[static_cast<int>(property)].fallback;
  for (const DofValue& given : joint.dof)
    if (given.property == property && !given.values.empty())
      value = given.values[std::min(i, given.values.size() - 1)];
  return value;
}

}  // namespace

void note_idle(const JointSpec& joint, std::vector<Note>& notes) {
  const size_t nv = joint_dof(joint);
  const auto warn = [&](std::string text) {
    notes.push_back({NoteLevel::warning, joint.name, std::move(text)});
  };
  for (const auto [property, needed] : dependents) {
    const DofPropertyEntry& entry = dof_property_table[static_cast<int>(property)];
    size_t idle = 0;
    for (size_t i = 0; i < nv; ++i)
      idle += value_of(joint, property, i) != entry.fallback && value_of(joint, needed, i) == 0;
    // One value stands for all degrees of freedom, and serves those that need it.
    bool apart = false;
    for (const DofValue& given : joint.dof)
      apart |= given.property == property && given.values.size() > 1;
    if (idle > 0 && (apart || idle == nv)) {
      const std::string other = dof_property_table[static_cast<int>(needed)].name;
      warn(std::string(entry.name) + " has no effect, because " + other + " is zero; give " +
           other + " as well, or leave both out");
    }
  }
  bool stiff = false, ranged = false;
  for (size_t i = 0; i < nv; ++i) {
    stiff |= value_of(joint, DofProperty::limit_stiffness, i) > 0;
    ranged |= std::isfinite(value_of(joint, DofProperty::lower, i)) ||
              std::isfinite(value_of(joint, DofProperty::upper, i));
  }
  if (stiff && !ranged)
    warn("limit_stiffness has no effect, because the range has no ends; give lower or upper");
}

void note_idle_limits(const JointSpec& spring, std::vector<Note>& notes) {
  if (value_of(spring, DofProperty::limit_stiffness, 0) > 0) return;
  for (const DofProperty limit : {DofProperty::lower, DofProperty::upper})
    if (std::isfinite(value_of(spring, limit, 0)))
      notes.push_back({NoteLevel::warning, spring.name,
                       std::string(dof_property_table[static_cast<int>(limit)].name) +
                           " has no effect, because limit_stiffness is zero; give limit_stiffness, "
                           "that of the rope or the stop"});
}

void validate_link(const LinkSpec& link, const std::string& where, std::vector<Note>& notes) {
  const std::string head = "link '" + link.name + "'" + where + ": ";
  if (link.name.empty())
    throw InputError("a link" + where + " has an empty name; give every link a name");
  if (!std::isfinite(link.mass))
    throw InputError(head + "mass is not a finite number; give a mass in kg");
  if (link.mass < 0)
    throw InputError(head + "mass is negative (" + number_text(link.mass) +
                     "); give a mass >= 0 in kg");
  if (!finite(link.com))
    throw InputError(head + "centre of mass is not finite; give three finite numbers in m");
  for (double x : link.inertia.m)
    if (!std::isfinite(x))
      throw InputError(head + "inertia is not finite; give finite numbers in kg m2");
  const int kind = static_cast<int>(link.body_kind), n = BodyKinds::n_parameters[kind];
  if (n >= 0 && static_cast<int>(link.parameters.size()) != n)
    throw InputError(head + "body kind " + BodyKinds::names[kind] + " takes " + std::to_string(n) +
                     " parameters, not " + std::to_string(link.parameters.size()));
  for (double x : link.parameters)
    if (!std::isfinite(x))
      throw InputError(head + "a parameter of body kind " + BodyKinds::names[kind] +
                       " is not finite; give finite numbers");
  const std::string fault = BodyKinds::dispatch(
      link.body_kind, [&](auto of) { return decltype(of)::Body::fault(link.parameters); });
  if (!fault.empty()) throw InputError(head + fault);
  double principal[3];
  principal_moments(link.inertia, principal);
  const double scale = std::max(std::abs(principal[0]), std::abs(principal[2]));
  if (link.mass == 0 && scale > 0)
    notes.push_back({NoteLevel::warning, link.name, "has rotational inertia but no mass"});
  if (link.mass > 0 && principal[0] <= 1e-12 * scale)
    notes.push_back({NoteLevel::warning, link.name, "a principal moment of inertia is zero"});
  else if (scale > 0 && !clearly_negative(link.mass, principal) &&
           principal[0] + principal[1] < principal[2] * (1 - 1e-9))
    notes.push_back(
        {NoteLevel::warning, link.name,
         "principal moments of inertia break the triangle inequality: no real body has them"});
}

void require_rotation(const Mat3<double>& R, const std::string& what) {
  double worst = 0;
  const Mat3<double> product = transpose(R) * R;
  for (int i = 0; i < 9; ++i) {
    if (!std::isfinite(R.m[i]))
      throw InputError(what + " is not finite; give a 3x3 rotation matrix");
    worst = std::max(worst, std::abs(product.m[i] - (i % 4 == 0)));
  }
  const auto& r = R.m;
  const double det = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                     r[2] * (r[3] * r[7] - r[4] * r[6]);
  if (worst > 1e-6 || det < 0)
    throw InputError(what +
                     " is not a rotation matrix; give an orthonormal right-handed 3x3 matrix");
}

void validate_joint(JointSpec& joint, const std::string& where) {
  const std::string head = "joint '" + joint.name + "'" + where + ": ";
  if (joint.name.empty())
    throw InputError("a joint" + where + " has an empty name; give every joint a name");
  if (!finite(joint.translation))
    throw InputError(head + "translation is not finite; give three finite numbers in m");
  require_rotation(joint.rotation, head + "rotation");
  const int n_axes = static_cast<int>(joint.axes.size()), expected = info_of(joint.type).n_axes;
  if (n_axes < std::abs(expected))
    throw InputError(head + "has " + std::to_string(n_axes) + " axes; a " +
                     joint_type_name(joint.type) + " joint needs " +
                     (expected < 0 ? "at least one" : std::to_string(expected)));
  if (expected >= 0) joint.axes.resize(expected);
  for (AxisSpec& a : joint.axes) {
    if (!finite(a.axis)) throw InputError(head + "axis is not finite; give three finite numbers");
    const double largest = std::max({std::abs(a.axis.x), std::abs(a.axis.y), std::abs(a.axis.z)});
    if (largest == 0) throw InputError(head + "axis has zero length; give a nonzero axis");
    // What has unit length but for rounding stays as it is: a model made of a model's description
    // is the same, bit by bit.
    constexpr double rounding = 8 * std::numeric_limits<double>::epsilon();
    if (largest > 2 || !(std::abs(dot(a.axis, a.axis) - 1) <= rounding)) {
      a.axis = (1 / largest) *
               a.axis;  // first, so that 1e200 and 1e-200 do not overflow or vanish when squared
      a.axis = (1 / std::sqrt(dot(a.axis, a.axis))) * a.axis;
    }
    if (!std::isfinite(a.pitch))
      throw InputError(head + "pitch is not finite; give the advance in m per rad");
  }
  validate_initial(joint, head);
  const int nv = joint_dof(joint);
  if (nv > 6 && joint.type != JointType::elastic)
    throw InputError(head + "has " + std::to_string(nv) +
                     " degrees of freedom; a joint can have 6 at most");
}

void append_dof_properties(const JointSpec& joint, const std::string& where,
                           std::array<std::vector<double>, n_dof_properties>& dof) {
  const std::string head = "joint '" + joint.name + "'" + where + ": ";
  const int nv = joint_dof(joint);
  const size_t start = dof[0].size();
  for (int p = 0; p < n_dof_properties; ++p)
    dof[p].insert(dof[p].end(), nv, dof_property_table[p].fallback);
  for (const DofValue& given : joint.dof) {
    const int p = static_cast<int>(given.property);
    const DofPropertyEntry& entry = dof_property_table[p];
    const size_t count = given.values.size();
    if (count != 1 && count != static_cast<size_t>(nv))
      throw InputError(head + entry.name + " has " + std::to_string(count) +
                       " values but the joint has " + std::to_string(nv) +
                       " degrees of freedom; give one value or " + std::to_string(nv));
    for (int i = 0; i < nv; ++i) {
      const double x = given.values[count == 1 ? 0 : i];
      if (std::isnan(x) || (!entry.infinite_ok && std::isinf(x)))
        throw InputError(head + entry.name + " is not a finite number; give a finite value");
      if (!entry.negative_ok && x < 0)
        throw InputError(head + entry.name + " is negative (" + number_text(x) +
                         "); give a value >= 0");
      dof[p][start + i] = x;
    }
  }
  const auto at = [&](DofProperty p, int i) { return dof[static_cast<int>(p)][start + i]; };
  for (int k = 0, first = 0; k < n_joint_elements(joint); ++k) {
    const ElementKindInfo& kind = info_of(joint_element(joint, k).kind);
    for (int i = first + 1; i < first + kind.turning; ++i)
      if (at(DofProperty::armature, i) != at(DofProperty::armature, first))
        throw InputError(head +
                         "armature differs between its linear degrees of freedom, whose axes turn "
                         "with the child; give these the same value");
    first += kind.nv;
  }
  bool quaternion = false;
  for (int k = 0; k < n_joint_elements(joint); ++k)
    quaternion |= info_of(joint_element(joint, k).kind).quaternion >= 0;
  for (int i = 0; i < nv; ++i) {
    const double lower = at(DofProperty::lower, i), upper = at(DofProperty::upper, i);
    if (lower > upper)
      throw InputError(head + "lower limit " + number_text(lower) + " is above the upper limit " +
                       number_text(upper) +
                       "; swap them, or leave both out where there is no limit");
    if (at(DofProperty::friction, i) > 0 && at(DofProperty::friction_velocity, i) == 0)
      throw InputError(
          head + "friction_velocity is zero; give the speed below which friction is smoothed");
    if (quaternion &&
        (at(DofProperty::stiffness, i) > 0 || at(DofProperty::limit_stiffness, i) > 0))
      throw InputError(head +
                       "springs and limits need an angle or a distance; use a composite joint of "
                       "axes instead of " +
                       joint_type_name(joint.type));
  }
}

std::string suggest(const std::string& name, const std::vector<std::string>& known) {
  if (known.empty()) return "; there are none";
  const std::string* best = &known.front();
  int best_distance = 1 << 30;
  const size_t searched = std::min<size_t>(known.size(), 2000);
  for (size_t i = 0; i < searched; ++i) {
    const int distance = edit_distance(name.substr(0, 100), known[i].substr(0, 100));
    if (distance < best_distance) {
      best_distance = distance;
      best = &known[i];
    }
  }
  if (best_distance <= std::max<int>(2, static_cast<int>(name.size()) / 3))
    return "; did you mean '" + *best + "'?";
  std::string list = "; known: ";
  for (size_t i = 0; i < std::min<size_t>(known.size(), 8); ++i) list += (i ? ", " : "") + known[i];
  return known.size() > 8 ? list + ", ..." : list;
}

}  // namespace linkwise
