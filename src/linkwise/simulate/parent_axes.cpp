#include "linkwise/simulate/parent_axes.hpp"

#include <cmath>

namespace linkwise {
namespace {

/// Child's axes in components of the previous frame, transposed.
Mat3<double> rotation(const Element& e, const double* q) {
  const double* own = q + e.q;
  if (e.kind == ElementKind::floating) return rotation_to_child(own + 3);
  const double c = std::cos(own[2]), s = std::sin(own[2]);
  return {c, s, 0, -s, c, 0, 0, 0, 1};
}

/// Linear components that a rate of the element has: three, or two in a plane.
int n_linear(const Element& e) { return e.kind == ElementKind::floating ? 3 : 2; }

Vec3<double> linear(const Element& e, const double* v) {
  const double* u = v + e.v;
  return {u[0], u[1], e.kind == ElementKind::floating ? u[2] : 0};
}

Vec3<double> angular(const Element& e, const double* v) {
  const double* u = v + e.v;
  if (e.kind == ElementKind::floating) return {u[3], u[4], u[5]};
  return {0, 0, u[2]};
}

void write(const Element& e, const Vec3<double>& u, double* v) {
  const double parts[3] = {u.x, u.y, u.z};
  for (int i = 0; i < n_linear(e); ++i) v[e.v + i] = parts[i];
}

}  // namespace

ParentAxes::ParentAxes(const Model& model) {
  for (const Element& e : model.elements)
    if (e.kind == ElementKind::floating || e.kind == ElementKind::planar) elements_.push_back(e);
}

void ParentAxes::from_child(const double* q, double* v) const {
  for (const Element& e : elements_) write(e, transpose_times(rotation(e, q), linear(e, v)), v);
}

void ParentAxes::to_child(const double* q, double* v) const {
  for (const Element& e : elements_) write(e, rotation(e, q) * linear(e, v), v);
}

void ParentAxes::derivative_from_child(const double* q, const double* v, double* dv) const {
  for (const Element& e : elements_) {
    const Vec3<double> turning = cross(angular(e, v), linear(e, v));
    write(e, transpose_times(rotation(e, q), linear(e, dv) + turning), dv);
  }
}

}  // namespace linkwise
