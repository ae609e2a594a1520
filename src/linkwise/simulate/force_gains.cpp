#include "linkwise/simulate/force_gains.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "linkwise/forces/coordinate_forces.hpp"
#include "linkwise/kinematics/loop_states.hpp"

namespace linkwise {
namespace {

/// joint: as a row of loads.
void add_rows(const Setup& setup, const Element& e, int joint, std::vector<GainRow>& rows) {
  const Model& m = *setup.model;
  const bool closes = joint >= m.n_joints();
  const int before_q = closes ? m.nq() : 0, before_v = closes ? m.nv() : 0;
  const Drive& drive = setup.drives[joint];
  const bool scalar = has_scalar_coordinates(e), pd = drive.kind == DriveKind::pd;
  const int turning = info_of(e.kind).turning;
  for (int k = 0; k < e.nv; ++k) {
    const int i = e.v + k;
    const auto at = [&](DofProperty p) {
      return closes ? m.loops.dof[static_cast<int>(p)][i] : m.dof_values(p)[i];
    };
    GainRow row{.joint = joint, .q = scalar ? before_q + e.q + k : -1, .v = before_v + i};
    row.group = before_v + (k < turning ? e.v : i);
    if (k < turning) row.width = turning;
    row.closes = closes;
    if (k < turning || e.kind == ElementKind::prismatic) row.unit = "N";
    row.damping = at(DofProperty::damping) + (pd ? drive.kd : 0);
    row.friction = at(DofProperty::friction);
    row.friction_velocity = at(DofProperty::friction_velocity);
    if (scalar) {
      row.stiffness = at(DofProperty::stiffness) + (pd ? drive.kp : 0);
      row.stop = at(DofProperty::limit_stiffness);
      row.stop_damping = at(DofProperty::limit_damping);
      row.lower = at(DofProperty::lower);
      row.upper = at(DofProperty::upper);
    }
    if (row.damping != 0 || row.friction > 0 || row.stiffness != 0 || row.stop > 0)
      rows.push_back(row);
  }
}

}  // namespace

std::vector<GainRow> gain_rows(const Setup& setup) {
  std::vector<GainRow> rows;
  for (const Element& e : setup.driven().elements)
    if (!e.prescribed) add_rows(setup, e, e.joint, rows);
  const Model& m = setup.driven();
  for (int l = 0; l < m.n_loops(); ++l)
    for (const Element& e : stack_of(m, m.loops.joints[l]))
      if (!e.prescribed) add_rows(setup, e, m.n_joints() + l, rows);
  return rows;
}

Contact contact(const GainRow& row, double q, double v) {
  const double above = q - row.upper, below = row.lower - q;
  if (above > below) return {above, v, 1};
  return {below, -v, -1};
}

double stop_stiffness(const GainRow& row, double speed) {
  return row.stop * std::max(0.0, 1 + row.stop_damping * speed);
}

double no_force(const Model& model, const GainRow& row) {
  constexpr double share = 1e-10;
  const Vec3<double>& g = model.gravity;
  const double force = share * model.total_mass() * std::sqrt(dot(g, g));
  if (std::string_view(row.unit) == "N") return force;
  std::vector<double> reach(model.n_bodies());
  double farthest = 0;
  for (int n = 0; n < model.n_bodies(); ++n) {
    const BodyTopology& body = model.topology[n];
    if (body.parent >= 0) reach[n] = reach[body.parent];
    for (int i = 0; i < body.n_elements; ++i) {
      const Vec3<double>& r = model.elements[body.first_element + i].placement.r;
      reach[n] += std::sqrt(dot(r, r));
    }
    farthest = std::max(farthest, reach[n]);
  }
  return force * farthest;
}

std::string ForceDoubt::text(const Model& model) const {
  char text[400];
  std::snprintf(text, sizeof text,
                "the force of joint '%.80s' may be wrong by %.2g %s, where the largest is %.2g %s, "
                "at t = %.4g s: ",
                model.joint_at(row->joint).name.c_str(), error, row->unit, largest, row->unit,
                time);
  return text;
}

}  // namespace linkwise
