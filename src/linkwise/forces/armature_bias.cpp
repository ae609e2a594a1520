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

/// Of the joints of a tree, or of those that close loops.
template <class Joints>
const double* armature_of(const Joints& joints, const Element& e) {
  return joints.dof[static_cast<int>(DofProperty::armature)].data() + e.v;
}

template <class Joints>
bool has_bias(const Joints& joints, const Element& e) {
  const double* D = armature_of(joints, e);
  const bool turns = info_of(e.kind).turning > 0 || info_of(e.kind).quaternion >= 0;
  return turns && std::any_of(D, D + e.nv, [](double x) { return x > 0; });
}

template <class Joints>
bool any_has_bias(const Joints& joints) {
  return std::any_of(joints.elements.begin(), joints.elements.end(),
                     [&](const Element& e) { return has_bias(joints, e); });
}

template <class Joints>
void add_bias(const Joints& joints, const double* v, double factor, double* tau) {
  for (const Element& e : joints.elements) {
    if (!has_bias(joints, e)) continue;
    const double* D = armature_of(joints, e);
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

}  // namespace

bool has_armature_bias(const Model& model, const Element& e) { return has_bias(model, e); }
bool has_armature_bias(const Model& model) { return any_has_bias(model); }
bool has_armature_bias(const LoopJoints& loops) { return any_has_bias(loops); }

void add_armature_bias(const Model& model, const double* v, double factor, double* tau) {
  add_bias(model, v, factor, tau);
}
void add_armature_bias(const LoopJoints& loops, const double* v, double factor, double* tau) {
  add_bias(loops, v, factor, tau);
}

}  // namespace linkwise
