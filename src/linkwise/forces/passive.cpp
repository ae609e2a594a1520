#include "linkwise/forces/passive.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/forces/coordinate_forces.hpp"

namespace linkwise {
namespace {

/// Of the joints of a tree, or of those that close loops.
template <class Joints>
void add_forces(const Joints& joints, const double* q, const double* v, double* tau) {
  const auto values = [&](DofProperty p) -> const std::vector<double>& {
    return joints.dof[static_cast<int>(p)];
  };
  const auto& damping = values(DofProperty::damping);
  const auto& friction = values(DofProperty::friction);
  const auto& friction_velocity = values(DofProperty::friction_velocity);
  const auto& stiffness = values(DofProperty::stiffness);
  const auto& rest = values(DofProperty::rest_position);
  const auto& lower = values(DofProperty::lower);
  const auto& upper = values(DofProperty::upper);
  const auto& stop = values(DofProperty::limit_stiffness);
  const auto& stop_damping = values(DofProperty::limit_damping);
  const auto resistance = [&](int i, double rate) {
    double force = -damping[i] * rate;
    if (friction[i] > 0) force -= friction[i] * std::tanh(rate / friction_velocity[i]);
    return force;
  };
  for (const Element& e : joints.elements) {
    const int turning = info_of(e.kind).turning;
    if (turning > 0) {
      const Mat3<double> R = element_rotation(e, q);
      const Vec3<double> rate = transpose_times(R, linear_part(e, v));
      const Vec3<double> force =
          R * Vec3<double>{resistance(e.v, rate.x), resistance(e.v + 1, rate.y),
                           turning == 3 ? resistance(e.v + 2, rate.z) : 0};
      tau[e.v] += force.x;
      tau[e.v + 1] += force.y;
      if (turning == 3) tau[e.v + 2] += force.z;
    }
    for (int i = e.v + turning; i < e.v + e.nv; ++i) tau[i] += resistance(i, v[i]);
  }
  for (const Element& e : joints.elements) {
    if (!has_scalar_coordinates(e)) continue;
    double rate[most_coordinates], force[most_coordinates];
    scalar_rates(e, q, v, rate);
    for (int k = 0; k < e.nv; ++k) {
      const int i = e.v + k;
      const double x = q[e.q + k];
      force[k] = -stiffness[i] * (x - rest[i]);
      if (!(stop[i] > 0)) continue;
      if (x > upper[i])
        force[k] -= stop[i] * (x - upper[i]) * std::max(0.0, 1 + stop_damping[i] * rate[k]);
      if (x < lower[i])
        force[k] += stop[i] * (lower[i] - x) * std::max(0.0, 1 - stop_damping[i] * rate[k]);
    }
    add_coordinate_forces(e, q, force, tau);
  }
}

template <class Joints>
double stored_energy(const Joints& joints, const double* q) {
  double energy = 0;
  for (const Element& e : joints.elements)
    for (int k = 0; has_scalar_coordinates(e) && k < e.nv; ++k) {
      const auto at = [&](DofProperty p) { return joints.dof[static_cast<int>(p)][e.v + k]; };
      const double x = q[e.q + k], stretch = x - at(DofProperty::rest_position);
      energy += 0.5 * at(DofProperty::stiffness) * stretch * stretch;
      if (!(at(DofProperty::limit_stiffness) > 0)) continue;
      const double depth = std::max({0.0, x - at(DofProperty::upper), at(DofProperty::lower) - x});
      energy += 0.5 * at(DofProperty::limit_stiffness) * depth * depth;
    }
  return energy;
}

}  // namespace

void add_passive_forces(const Model& model, const double* q, const double* v, double* tau) {
  if (model.has_passive_forces()) add_forces(model, q, v, tau);
}

void add_passive_forces(const LoopJoints& loops, const double* q, const double* v, double* tau) {
  add_forces(loops, q, v, tau);
}

bool has_passive_forces(const LoopJoints& loops) {
  using enum DofProperty;
  for (const DofProperty p : {damping, friction, stiffness, limit_stiffness})
    for (const double x : loops.dof[static_cast<int>(p)])
      if (x != 0) return true;
  return false;
}

double passive_potential(const Model& model, const double* q) {
  return model.has_passive_forces() ? stored_energy(model, q) : 0;
}

double passive_potential(const LoopJoints& loops, const double* q) {
  return stored_energy(loops, q);
}

}  // namespace linkwise
