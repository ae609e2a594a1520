#include "linkwise/model/flexible_link.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>

#include "linkwise/base/error.hpp"
#include "linkwise/model/validate.hpp"
#include "linkwise/spatial/composite.hpp"

namespace linkwise {
namespace {

double length_of(const Vec3<double>& a) { return std::sqrt(dot(a, a)); }

using Attached = FlexibleLinks::Attached;

/// Is a point of a link where its elastic body starts?
bool is_start(const Vec3<double>& point, double length) {
  return length_of(point) <= 1e-9 * (1 + length);
}

/// The joints that the link carries are all at this point, if there are any, but for those that
/// close loops at its start.
std::optional<Vec3<double>> carried_at(const ModelSpec& spec, const Attached& on,
                                       const std::string& link, const std::string& head) {
  const JointSpec* first = nullptr;
  for (const int j : on.joints) {
    const JointSpec& joint = spec.joints[j];
    if (!first) first = &joint;
    if (length_of(joint.translation - first->translation) >
        1e-9 * (1 + length_of(joint.translation)))
      throw InputError(head + "joints '" + first->name + "' and '" + joint.name +
                       "' are at different points of it; let all joints be at its end, and rigid "
                       "links carry what is elsewhere");
  }
  const std::string* name = first ? &first->name : nullptr;
  Vec3<double> end = first ? first->translation : Vec3<double>{};
  for (const int l : on.loops)
    for (const bool parent : {true, false}) {
      const LoopJointSpec& loop = spec.loop_joints[l];
      if ((parent ? loop.joint.parent : loop.joint.child) != link) continue;
      const Vec3<double>& point = parent ? loop.joint.translation : loop.child_translation;
      if (is_start(point, length_of(end))) continue;
      if (!name) end = point;
      if (length_of(point - end) > 1e-9 * (1 + length_of(point)))
        throw InputError(head + "joints '" + *name + "' and '" + loop.joint.name +
                         "' are at different points of it; let all joints be at its end or its "
                         "start, and rigid links carry what is elsewhere");
      name = &loop.joint.name;
    }
  if (!name) return {};
  return end;
}

std::string point_text(const Vec3<double>& r) {
  return "(" + number_text(r.x) + ", " + number_text(r.y) + ", " + number_text(r.z) + ")";
}

Vec3<double> end_of(const ModelSpec& spec, const Attached& on, const FlexibleLink& flexible,
                    const std::string& head) {
  const std::optional<Vec3<double>> carried = carried_at(spec, on, flexible.link, head);
  if (carried && flexible.end && length_of(*flexible.end) > 0 &&
      length_of(*carried - *flexible.end) > 1e-6 * (1e-3 + length_of(*flexible.end)))
    throw InputError(head + "carries joints at " + point_text(*carried) + ", and its end is at " +
                     point_text(*flexible.end) +
                     " in the link's frame; let the joints be there, and put payloads on '" +
                     flexible.link + ":end'");
  const std::optional<Vec3<double>> end = flexible.end ? flexible.end : carried;
  if (!end)
    throw InputError(head +
                     "carries no joint that would say where it ends; give end, a point in "
                     "the link's frame");
  return *end;
}

/// Columns: x along the beam, z as near as can be to the one that is wanted.
Mat3<double> beam_axes(const FlexibleLink& flexible, const Vec3<double>& end,
                       const std::string& head) {
  const Vec3<double> x = (1 / length_of(end)) * end;
  Vec3<double> z = flexible.z.value_or(Vec3<double>{0, 0, 1});
  if (flexible.z && !(length_of(cross(z, x)) > 1e-6 * length_of(z)))
    throw InputError(head + "z is along the beam or zero; give a direction across it");
  // Well apart from where rounding of a model's angles could choose.
  if (!flexible.z && !(length_of(cross(z, x)) > 0.02)) z = {1, 0, 0};
  z = z - dot(z, x) * x;
  z = (1 / length_of(z)) * z;
  const Vec3<double> y = cross(z, x);
  return {{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}};
}

void require_positive(const std::string& head, const char* name, double value, const char* unit) {
  if (!(value > 0) || !std::isfinite(value))
    throw InputError(head + name + " is " + number_text(value) + "; give a positive number" +
                     (*unit ? std::string(" in ") + unit : ""));
}

void check_numbers(const FlexibleLink& of, const std::string& head) {
  require_positive(head, "E", of.E, "Pa");
  require_positive(head, "G", of.G, "Pa");
  require_positive(head, "the section's area", of.area, "m2");
  require_positive(head, "the section's Iy", of.Iy, "m4");
  require_positive(head, "the section's Iz", of.Iz, "m4");
  require_positive(head, "the section's J", of.J, "m4");
  if (of.density) require_positive(head, "density", *of.density, "kg/m3");
  if (!(of.damping >= 0) || !std::isfinite(of.damping))
    throw InputError(head + "damping is " + number_text(of.damping) +
                     "; give the damping ratio of its modes, 0 or more");
  if (of.bodies < 1 || of.bodies > 100000)
    throw InputError(head + "bodies is " + std::to_string(of.bodies) +
                     "; give the number of beams in a row, 1 to 100000");
  if (of.interior_modes < 0 || of.interior_modes > most_interior_modes)
    throw InputError(head + "interior_modes is " + std::to_string(of.interior_modes) +
                     "; give 0 to " + std::to_string(most_interior_modes) + ", or more bodies");
}

/// A straight beam from the origin along x, as a rigid link.
void set_straight(LinkSpec& link, const BeamProperties& of, const Mat3<double>& axes) {
  const double L = of.length, m = of.mass_per_length * L;
  link.mass = m;
  link.com = axes * Vec3<double>{L / 2, 0, 0};
  Sym3<double> I{{L * (of.rotary_y + of.rotary_z), 0, L * of.rotary_y + m * L * L / 12, 0, 0,
                  L * of.rotary_z + m * L * L / 12}};
  link.inertia = congruence(transpose(axes), I);
  link.body_kind = BodyKind::beam;
  const auto* first = reinterpret_cast<const double*>(&of);
  link.parameters.assign(first, first + Beam::n_parameters);
}

/// What hung on the link hangs on `end`, whose frame is that of the beam, moved there. Joints that
/// close loops at its start stay on the link.
void move_to_end(ModelSpec& spec, const Attached& on, const std::string& link,
                 const std::string& end, const Mat3<double>& axes, const Vec3<double>& at) {
  const auto move = [&](std::string& name, Mat3<double>& rotation, Vec3<double>& translation) {
    if (name != link) return;
    name = end;
    rotation = transpose(axes) * rotation;
    translation = transpose_times(axes, translation - at);
    if (length_of(translation) <= 1e-9 * (1 + length_of(at))) translation = {};
  };
  for (const int j : on.joints) {
    JointSpec& joint = spec.joints[j];
    move(joint.parent, joint.rotation, joint.translation);
  }
  for (const int l : on.loops) {
    LoopJointSpec& loop = spec.loop_joints[l];
    if (!is_start(loop.joint.translation, length_of(at)))
      move(loop.joint.parent, loop.joint.rotation, loop.joint.translation);
    if (!is_start(loop.child_translation, length_of(at)))
      move(loop.joint.child, loop.child_rotation, loop.child_translation);
  }
}

std::string hertz(double omega) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", omega / (2 * std::numbers::pi));
  return text;
}

/// Of the whole link, clamped where it starts and free where it ends.
std::string frequencies(const BeamProperties& of, double length) {
  const double mu = of.mass_per_length, bending = 3.5160152685 / (length * length),
               quarter = std::numbers::pi / 2 / length;
  std::string text = "is an elastic beam of " + number_text(length) +
                     " m; clamped at its start it " + "bends at " +
                     hertz(bending * std::sqrt(of.EIz / mu)) + " Hz along its y and " +
                     hertz(bending * std::sqrt(of.EIy / mu)) + " Hz along its z, twists at " +
                     hertz(quarter * std::sqrt(of.GJ / (of.rotary_y + of.rotary_z))) + " Hz";
  if (of.stretches != 0)
    text += " and stretches at " + hertz(quarter * std::sqrt(of.EA / mu)) + " Hz";
  return text;
}

std::string head_of(const ModelSpec& spec, const std::string& name) {
  return "flexible link '" + name + "'" + source_of(spec) + ": ";
}

/// Of a modal body, clamped where it starts and free elsewhere.
std::string frequencies(const ModalShape& of) {
  std::string text = "is an elastic body of " + std::to_string(of.n) +
                     " modes; clamped at its start it vibrates at ";
  const int shown = std::min(of.n, 3);
  for (int k = 0; k < shown; ++k)
    text += (k == 0          ? ""
             : k + 1 < shown ? ", "
                             : " and ") +
            hertz(std::sqrt(of.stiffness[k] / of.m_e[packed(k, k)]));
  return text + " Hz" + (shown < of.n ? ", up to " : "") +
         (shown < of.n
              ? hertz(std::sqrt(of.stiffness[of.n - 1] / of.m_e[packed(of.n - 1, of.n - 1)])) +
                    " Hz"
              : "");
}

Sym3<double> about_centre(const Inertia<double>& M, const Vec3<double>& c) {
  Sym3<double> I = M.I;
  I.m[0] -= M.m * (c.y * c.y + c.z * c.z);
  I.m[1] += M.m * c.x * c.y;
  I.m[2] -= M.m * (c.x * c.x + c.z * c.z);
  I.m[3] += M.m * c.x * c.z;
  I.m[4] += M.m * c.y * c.z;
  I.m[5] -= M.m * (c.x * c.x + c.y * c.y);
  return I;
}

}  // namespace

FlexibleLinks::FlexibleLinks(ModelSpec& spec) : spec_(spec) {
  for (size_t i = 0; i < spec.links.size(); ++i) link_.try_emplace(spec.links[i].name, i);
  for (const JointSpec& joint : spec.joints) moved_.insert(joint.child);
  for (size_t j = 0; j < spec.joints.size(); ++j)
    attached_[spec.joints[j].parent].joints.push_back(static_cast<int>(j));
  for (size_t l = 0; l < spec.loop_joints.size(); ++l) {
    const JointSpec& joint = spec.loop_joints[l].joint;
    attached_[joint.parent].loops.push_back(static_cast<int>(l));
    if (joint.child != joint.parent) attached_[joint.child].loops.push_back(static_cast<int>(l));
  }
}

LinkSpec& FlexibleLinks::rigid_link(const std::string& name, const std::string& head) {
  const auto found = link_.find(name);
  if (found == link_.end()) {
    std::vector<std::string> known;
    for (const LinkSpec& link : spec_.links) known.push_back(link.name);
    throw InputError(head + "does not exist" + suggest(name, known));
  }
  LinkSpec& link = spec_.links[found->second];
  if (link.body_kind != BodyKind::rigid)
    throw InputError(head + "is flexible already; make it so once");
  if (!spec_.floating_base && !moved_.contains(name))
    throw InputError(head +
                     "no joint moves it, it is the ground; let a fixed joint hold it on another "
                     "link, or the base float");
  for (const std::string& beam : {name + ":2", name + ":end"})
    if (link_.contains(beam))
      throw InputError(head + "link '" + beam + "' has the name of a part of it; rename that link");
  return link;
}

void FlexibleLinks::put(const JointSpec& joint, LinkSpec link) {
  link_.try_emplace(link.name, spec_.links.size());
  spec_.joints.push_back(joint);
  spec_.links.push_back(std::move(link));
}

void FlexibleLinks::add(const FlexibleLink& flexible) {
  ModelSpec& spec = spec_;
  const std::string& name = flexible.link;
  const std::string head = head_of(spec, name);
  LinkSpec& link = rigid_link(name, head);
  const Attached& on = attached_[name];
  check_numbers(flexible, head);
  const Vec3<double> end = end_of(spec, on, flexible, head);
  if (!(length_of(end) > 0) || !std::isfinite(length_of(end)))
    throw InputError(head +
                     "its ends coincide; give end, the point where it ends, apart from its "
                     "inboard joint");
  const Mat3<double> axes = beam_axes(flexible, end, head);
  const double length = length_of(end);
  if (!flexible.density && !(link.mass > 0))
    throw InputError(head + "has no mass; give density in kg/m3, or the link a mass");
  BeamProperties of{};
  of.length = length / flexible.bodies;
  of.mass_per_length = flexible.density ? *flexible.density * flexible.area : link.mass / length;
  of.EA = flexible.E * flexible.area;
  of.EIy = flexible.E * flexible.Iy;
  of.EIz = flexible.E * flexible.Iz;
  of.GJ = flexible.G * flexible.J;
  of.rotary_y = of.mass_per_length * flexible.Iy / flexible.area;
  of.rotary_z = of.mass_per_length * flexible.Iz / flexible.area;
  of.damping_ratio = flexible.damping;
  of.interior_modes = flexible.interior_modes;
  of.stretches = flexible.stretches;
  of.area = flexible.area;
  of.width = flexible.width;
  of.height = flexible.height;
  of.round = flexible.round;
  std::copy(axes.m, axes.m + 9, of.axes);
  set_straight(link, of, axes);  // before others are added
  const std::string tip = name + ":end";
  move_to_end(spec, on, name, tip, axes, end);
  attached_[tip] = on;

  JointSpec joint;
  joint.type = JointType::elastic;
  joint.rotation = axes;
  joint.translation = axes * Vec3<double>{of.length, 0, 0};
  const auto identity = Mat3<double>::identity();
  std::copy(identity.m, identity.m + 9, of.axes);
  std::string before = name;
  for (int i = 1; i <= flexible.bodies; ++i) {
    joint.name = name + ":" + std::to_string(i);
    joint.parent = before;
    joint.child = i < flexible.bodies ? name + ":" + std::to_string(i + 1) : tip;
    LinkSpec next{joint.child, 0, {}, {}};
    if (i < flexible.bodies) set_straight(next, of, identity);
    put(joint, std::move(next));
    before = joint.child;
    joint.rotation = identity;
    joint.translation = {of.length, 0, 0};
  }
  spec.notes.push_back({NoteLevel::info, name, frequencies(of, length)});
}

void FlexibleLinks::add(const ModalLink& flexible) {
  ModelSpec& spec = spec_;
  const std::string& name = flexible.link;
  const std::string head = head_of(spec, name);
  LinkSpec& link = rigid_link(name, head);
  const Attached& on = attached_[name];
  if (const std::string fault = ModalBody::fault(flexible.parameters); !fault.empty())
    throw InputError(head + fault);
  const std::optional<Vec3<double>> at = carried_at(spec, on, name, head);
  std::vector<double> parameters = flexible.parameters;
  double& has_port = parameters[offsetof(ModalProperties, has_port) / sizeof(double)];
  if (at && has_port == 0)
    throw InputError(head +
                     "carries joints, and its body has no outboard handle; give the body "
                     "one, or the joints another link");
  has_port = 1;  // where it has none, one that does not move: users see coordinates of joints
  const ModalBody body = ModalBody::make({}, parameters);
  const Inertia<double>& M = body.straight.inertia;
  link.mass = M.m;
  link.com = (1 / M.m) * M.mc;
  link.inertia = about_centre(M, link.com);
  link.body_kind = BodyKind::modal;
  link.parameters = std::move(parameters);
  spec.notes.push_back({NoteLevel::info, name, frequencies(*body.shape)});
  const Mat3<double> axes = transpose(body.to_axes.R);
  const Vec3<double> end = axes * body.port()->rest;
  if (at && length_of(*at - end) > 1e-6 * (1e-3 + length_of(end)))
    throw InputError(head + "carries joints at " + point_text(*at) +
                     ", and its outboard handle is at " + point_text(end) +
                     " in the link's frame; let the joints be there");
  const std::string tip = name + ":end";
  move_to_end(spec, on, name, tip, axes, at ? *at : end);
  attached_[tip] = on;
  JointSpec joint;
  joint.type = JointType::elastic;
  joint.name = name + ":1";
  joint.parent = name;
  joint.child = tip;
  joint.rotation = axes;
  joint.translation = end;
  put(joint, {tip, 0, {}, {}});
}

}  // namespace linkwise
