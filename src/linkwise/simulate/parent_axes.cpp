#include "linkwise/simulate/parent_axes.hpp"

namespace linkwise {
namespace {

void write(const Element& e, const Vec3<double>& u, double* v) {
  const double parts[3] = {u.x, u.y, u.z};
  for (int i = 0; i < info_of(e.kind).turning; ++i) v[e.v + i] = parts[i];
}

}  // namespace

ParentAxes::ParentAxes(const Model& model) {
  for (const Element& e : model.elements)
    if (info_of(e.kind).turning > 0) elements_.push_back(e);
}

void ParentAxes::from_child(const double* q, double* v) const {
  for (const Element& e : elements_)
    write(e, transpose_times(element_rotation(e, q), linear_part(e, v)), v);
}

void ParentAxes::to_child(const double* q, double* v) const {
  for (const Element& e : elements_) write(e, element_rotation(e, q) * linear_part(e, v), v);
}

void ParentAxes::derivative_from_child(const double* q, const double* v, double* dv) const {
  for (const Element& e : elements_) {
    const Vec3<double> turning = cross(angular_part(e, v), linear_part(e, v));
    write(e, transpose_times(element_rotation(e, q), linear_part(e, dv) + turning), dv);
  }
}

void ParentAxes::derivative_to_child(const double* q, const double* v, double* dv) const {
  for (const Element& e : elements_) {
    const Vec3<double> turning = cross(angular_part(e, v), linear_part(e, v));
    write(e, element_rotation(e, q) * linear_part(e, dv) - turning, dv);
  }
}

}  // namespace linkwise
