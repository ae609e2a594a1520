#include "linkwise/forces/passive.hpp"

#include <algorithm>
#include <cmath>

namespace linkwise {
namespace {

/// Calls f(q index, v index) for every degree of freedom that is an angle or a distance of its own.
template <class F>
void for_scalar_dofs(const Model& model, F&& f) {
  for (const Element& e : model.elements) {
    if (e.nq == 1) f(e.q, e.v);
    if (e.kind == ElementKind::planar)
      for (int k = 0; k < 3; ++k) f(e.q + k, e.v + k);
  }
}

}  // namespace

void add_passive_forces(const Model& model, const double* q, const double* v, double* tau) {
  if (!model.has_passive_forces()) return;
  const auto& damping = model.dof_values(DofProperty::damping);
  const auto& friction = model.dof_values(DofProperty::friction);
  const auto& friction_velocity = model.dof_values(DofProperty::friction_velocity);
  const auto& stiffness = model.dof_values(DofProperty::stiffness);
  const auto& rest = model.dof_values(DofProperty::rest_position);
  const auto& lower = model.dof_values(DofProperty::lower);
  const auto& upper = model.dof_values(DofProperty::upper);
  const auto& stop = model.dof_values(DofProperty::limit_stiffness);
  const auto& stop_damping = model.dof_values(DofProperty::limit_damping);
  for (int i = 0; i < model.nv(); ++i) {
    tau[i] -= damping[i] * v[i];
    if (friction[i] > 0) tau[i] -= friction[i] * std::tanh(v[i] / friction_velocity[i]);
  }
  for_scalar_dofs(model, [&](int iq, int iv) {
    tau[iv] -= stiffness[iv] * (q[iq] - rest[iv]);
    if (!(stop[iv] > 0)) return;
    if (q[iq] > upper[iv])
      tau[iv] -= stop[iv] * (q[iq] - upper[iv]) * std::max(0.0, 1 + stop_damping[iv] * v[iv]);
    if (q[iq] < lower[iv])
      tau[iv] += stop[iv] * (lower[iv] - q[iq]) * std::max(0.0, 1 - stop_damping[iv] * v[iv]);
  });
}

double passive_potential(const Model& model, const double* q) {
  if (!model.has_passive_forces()) return 0;
  double energy = 0;
  for_scalar_dofs(model, [&](int iq, int iv) {
    const auto at = [&](DofProperty p) { return model.dof_values(p)[iv]; };
    const double x = q[iq] - at(DofProperty::rest_position);
    energy += 0.5 * at(DofProperty::stiffness) * x * x;
    if (!(at(DofProperty::limit_stiffness) > 0)) return;
    const double depth =
        std::max({0.0, q[iq] - at(DofProperty::upper), at(DofProperty::lower) - q[iq]});
    energy += 0.5 * at(DofProperty::limit_stiffness) * depth * depth;
  });
  return energy;
}

}  // namespace linkwise
