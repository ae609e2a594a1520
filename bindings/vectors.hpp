#pragma once
// Vectors and matrices of three from Python.
#include "linkwise/model/builder.hpp"
#include "linkwise/spatial/vec3.hpp"
#include "numbers.hpp"

namespace linkwise::bindings {

inline Vec3<double> vec3(nb::handle value, const char* name) {
  const ArrayIn a = as_array(value, name);
  if (a.ndim() != 1 || a.shape(0) != 3)
    throw InputError(std::string(name) + " has shape " + shape_text(shape_of(a)) +
                     " but shape (3,) is expected");
  return {a.data()[0], a.data()[1], a.data()[2]};
}

inline Mat3<double> mat3(nb::handle value, const char* name) {
  const ArrayIn a = as_array(value, name);
  if (a.ndim() != 2 || a.shape(0) != 3 || a.shape(1) != 3)
    throw InputError(std::string(name) + " has shape " + shape_text(shape_of(a)) +
                     " but shape (3, 3) is expected");
  Mat3<double> m;
  std::copy(a.data(), a.data() + 9, m.m);
  return m;
}

/// A link from its mass, and its centre of mass and inertia or None.
LinkSpec link_spec(std::string name, double mass, nb::handle com, nb::handle inertia);

/// Joint properties by name, each a number, an array, or None.
Properties properties_from(const nb::dict& given);

/// Adds a joint that closes a loop; what is None stays as it is without.
void add_loop(ModelBuilder& builder, std::string name, const std::string& type, std::string parent,
              std::string child, nb::handle translation, nb::handle rotation,
              nb::handle child_translation, nb::handle child_rotation, nb::handle axis,
              nb::handle axes, double pitch, const nb::kwargs& properties);

void add_rod(ModelBuilder& builder, std::string name, std::string parent, std::string child,
             double length, nb::handle point, nb::handle child_point);
void add_spring(ModelBuilder& builder, std::string name, std::string parent, std::string child,
                double length, nb::handle point, nb::handle child_point,
                const nb::kwargs& properties);
void add_coupling(ModelBuilder& builder, std::string name, const nb::dict& factors, double offset);

}  // namespace linkwise::bindings
