#include "linkwise/forces/armature_bias.hpp"

#include <algorithm>

namespace linkwise {
namespace {

void add(const Vec3<double>& w, const Vec3<double>& u, const double* D, double factor,
         double* tau) {
  const Vec3<double> bias = cross(w, Vec3<double>{D[0] * u.x, D[1] * u.y, D[2] * u.z});
  const double parts[3] = {bias.x, bias.y, bias.z};
  for (int i = 0; i < 3; ++i) tau[i] += factor * parts[i];
}

}  // namespace

bool has_armature_bias(const Model& model, const Element& e) {
  const double* D = model.dof_values(DofProperty::armature).data() + e.v;
  const bool turns = info_of(e.kind).turning > 0 || info_of(e.kind).quaternion >= 0;
  return turns && std::any_of(D, D + e.nv, [](double x) { return x > 0; });
}

bool has_armature_bias(const Model& model) {
  return std::any_of(model.elements.begin(), model.elements.end(),
                     [&](const Element& e) { return has_armature_bias(model, e); });
}

void add_armature_bias(const Model& model, const double* v, double factor, double* tau) {
  const std::vector<double>& armature = model.dof_values(DofProperty::armature);
  for (const Element& e : model.elements) {
    if (!has_armature_bias(model, e)) continue;
    const double* D = armature.data() + e.v;
    const Vec3<double> w = angular_part(e, v);
    const int turning = info_of(e.kind).turning;
    if (turning == 2) {
      tau[e.v] -= factor * w.z * D[1] * v[e.v + 1];
      tau[e.v + 1] += factor * w.z * D[0] * v[e.v];
      continue;
    }
    if (turning == 3) add(w, linear_part(e, v), D, factor, tau + e.v);
    add(w, w, D + turning, factor, tau + e.v + turning);
  }
}

}  // namespace linkwise
