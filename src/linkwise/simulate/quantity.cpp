#include "linkwise/simulate/quantity.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "linkwise/base/error.hpp"
#include "linkwise/base/finite.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "linkwise/simulate/loop_forces.hpp"

namespace linkwise {
namespace {

using enum Axis;

void copy(const double* from, size_t n, double* to) { std::copy(from, from + n, to); }

size_t n_terms(const Model& model) {
  size_t n = 0;
  for (const Coupling& coupling : model.couplings) n += coupling.terms.size();
  return n;
}

void copy_work(const Instant& at, size_t first, size_t n, double* to) {
  if (at.work)
    copy(at.work + first, n, to);
  else
    std::fill_n(to, n, std::numeric_limits<double>::quiet_NaN());
}

constexpr QuantityEntry table[] = {
    {"position", "position", coordinates, Needs::state, true, "", "joint position", "", "",
     "zero as in the model file; angles are not wrapped; quaternions are x, y, z, w and take "
     "components in the joint frame to the inboard body's",
     [](const Instant& at, double* out) { copy(at.q, at.model.nq(), out); }, nullptr},
    {"velocity", "velocity", rates, Needs::state, true, "/s", "joint velocity",
     "of the outboard body relative to the inboard body; joints with more than one degree of "
     "freedom: in the joint frame, linear components first",
     "", "", [](const Instant& at, double* out) { copy(at.v, at.model.nv(), out); }, nullptr},
    {"loop_position", "position", loop_coordinates, Needs::state, true, "",
     "position of joints that close loops", "", "",
     "zero where the two frames of the joint are one; angles are not wrapped; quaternions as in "
     "position",
     [](const Instant& at, double* out) {
       if (at.loops) copy(at.loops->q(), at.model.loops.nq, out);
     },
     nullptr},
    {"loop_velocity", "velocity", loop_rates, Needs::state, true, "/s",
     "velocity of joints that close loops", "as velocity", "", "",
     [](const Instant& at, double* out) {
       if (at.loops) copy(at.loops->v(), at.model.loops.nv, out);
     },
     nullptr},
    {"acceleration", "acceleration", rates, Needs::forces, true, "/s^2", "joint acceleration", "",
     "", "time derivative of velocity, component by component",
     [](const Instant& at, double* out) { copy(at.du, at.model.nv(), out); }, nullptr},
    {"drive_torque", "drive_torque", rates, Needs::forces, true, "force", "drive torque or force",
     "", "", "power into the mechanism is drive_torque * velocity",
     [](const Instant& at, double* out) { copy(at.drive_torque, at.model.nv(), out); }, nullptr},
    {"loop_drive_torque", "drive_torque", loop_rates, Needs::forces, true, "force",
     "drive torque or force of joints that close loops", "", "",
     "power into the mechanism is loop_drive_torque * loop_velocity",
     [](const Instant& at, double* out) {
       if (at.loops) copy(at.loops->drive(), at.model.loops.nv, out);
     },
     nullptr},
    {"joint_load", "joint_load", joints, Needs::loads, true, "N, N m", "joint load",
     "joint frame, fixed in the outboard body", "joint point: the origin of the joint frame",
     "wrench that the inboard body exerts on the outboard body through the joint",
     [](const Instant& at, double* out) { copy(at.joint_load, 6 * at.model.n_loads(), out); },
     nullptr},
    {"coupling_load", "joint_load", terms, Needs::loads, true, "force", "load of a coupling", "",
     "", "torque or force that the coupling puts into the joint, beside its drive",
     [](const Instant& at, double* out) { copy(at.coupling_load, n_terms(at.model), out); },
     nullptr},
    {"external_wrench", "external_wrench", bodies, Needs::forces, false,
     "N (fx, fy, fz), N m (nx, ny, nz)", "external wrench", "joint frame, fixed in the body",
     "origin of the joint frame",
     "wrench that acts on the body from outside, by the wrenches of the simulation",
     [](const Instant& at, double* out) {
       const size_t n = 6 * at.model.n_joints();
       if (at.external)
         copy(at.external, n, out);
       else
         std::fill_n(out, n, 0.0);
     },
     nullptr},
    {"drive_work", "work", rates, Needs::works, true, "energy", "work of the drive", "", "",
     "integral of drive_torque * velocity since the start, along the integration's own steps",
     [](const Instant& at, double* out) { copy_work(at, 0, at.model.nv(), out); }, nullptr},
    {"loop_drive_work", "work", loop_rates, Needs::works, true, "energy",
     "work of the drives of joints that close loops", "", "",
     "integral of loop_drive_torque * loop_velocity since the start, along the integration's own "
     "steps",
     [](const Instant& at, double* out) { copy_work(at, at.model.nv(), at.model.loops.nv, out); },
     nullptr},
    {"external_work", "work", none, Needs::works, true, "J", "work of the external wrenches", "",
     "", "since the start, along the integration's own steps",
     [](const Instant& at, double* out) {
       copy_work(at, at.model.nv() + at.model.loops.nv, 1, out);
     },
     nullptr},
    {"dissipated_energy", "work", none, Needs::works, true, "J",
     "energy taken by damping, friction and the damping of stops", "", "",
     "since the start, along the integration's own steps",
     [](const Instant& at, double* out) {
       copy_work(at, at.model.nv() + at.model.loops.nv + 1, 1, out);
     },
     nullptr},
    {"kinetic_energy", "energy", none, Needs::state, true, "J", "kinetic energy", "", "", "",
     [](const Instant& at, double* out) { *out = kinetic_energy(at.model, at.q, at.v); }, nullptr},
    {"potential_energy", "energy", none, Needs::state, true, "J",
     "potential energy of gravity, springs and stops", "", "", "",
     [](const Instant& at, double* out) {
       *out = potential_energy(at.model, at.q, at.loops ? at.loops->q() : nullptr);
     },
     nullptr},
    {"steps", "statistics", none, Needs::state, false, "1",
     "accepted integration steps since the start", "", "", "", nullptr,
     [](const Instant& at) { return at.statistics.steps; }},
    {"evaluations", "statistics", none, Needs::state, false, "1",
     "evaluations of the equations of motion since the start", "", "", "", nullptr,
     [](const Instant& at) { return at.statistics.evaluations; }},
    {"iterations", "statistics", none, Needs::state, false, "1",
     "iterations of the linear solver since the start", "", "", "", nullptr,
     [](const Instant& at) { return at.statistics.iterations; }},
    {"step_size", "statistics", none, Needs::state, false, "s", "size of the last integration step",
     "", "", "", [](const Instant& at, double* out) { *out = at.statistics.last_step; }, nullptr},
    {"order", "statistics", none, Needs::state, false, "1",
     "order of the integration method in the last step", "", "", "", nullptr,
     [](const Instant& at) { return static_cast<long>(at.statistics.last_order); }},
};
static_assert(std::size(table) <= Sample::size);

}  // namespace

std::string_view to_string(Axis axis) {
  constexpr std::string_view names[] = {"coordinates", "rates",  "loop_coordinates", "loop_rates",
                                        "terms",       "joints", "bodies",           "none"};
  return names[static_cast<int>(axis)];
}

std::span<const QuantityEntry> quantity_table() { return table; }

size_t quantity_index(std::string_view name) {
  for (size_t k = 0; k < std::size(table); ++k)
    if (table[k].name == name) return k;
  throw InputError("quantity '" + std::string(name) + "' is unknown");
}

size_t quantity_width(const QuantityEntry& entry, const Model& model) {
  const int widths[] = {model.nq(),
                        model.nv(),
                        model.loops.nq,
                        model.loops.nv,
                        static_cast<int>(n_terms(model)),
                        6 * model.n_loads(),
                        6 * model.n_joints(),
                        1};
  return widths[static_cast<int>(entry.axis)];
}

bool Sample::needs(Needs needs) const {
  for (size_t k = 0; k < std::size(table); ++k)
    if ((values[k] || counts[k]) &&
        (table[k].needs == needs || (needs == Needs::forces && table[k].needs == Needs::loads)))
      return true;
  return false;
}

Sample Sample::at(const Model& model, size_t member, size_t row) const {
  Sample out = *this;
  for (size_t k = 0; k < std::size(table); ++k) {
    const size_t offset = (member * rows + row) * quantity_width(table[k], model);
    if (values[k]) out.values[k] += offset;
    if (counts[k]) out.counts[k] += offset;
  }
  return out;
}

void Sample::write(const Model& model, size_t member, const Instant* instant) const {
  for (size_t k = 0; k < std::size(table); ++k) {
    if (!values[k] && !counts[k]) continue;
    const size_t width = quantity_width(table[k], model), offset = member * rows * width;
    if (counts[k])
      counts[k][offset] = instant ? table[k].count(*instant) : -1;
    else if (instant)
      table[k].write(*instant, values[k] + offset);
    else
      std::fill_n(values[k] + offset, width, std::numeric_limits<double>::quiet_NaN());
  }
}

std::string_view Sample::not_finite(const Model& model, size_t member, bool works_are_known) const {
  for (size_t k = 0; k < std::size(table); ++k) {
    if (!values[k] || (table[k].needs == Needs::works && !works_are_known)) continue;
    const size_t width = quantity_width(table[k], model);
    const double* row = values[k] + member * rows * width;
    if (!all_finite({row, width})) return table[k].name;
  }
  return {};
}

}  // namespace linkwise
