#pragma once
// NumPy arrays in and out: float64 rows with any leading axes. Anything else that NumPy can turn
// into such an array (lists, integers, other strides) is turned; the common case costs no Python
// call.
#include <string>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include "linkwise/base/error.hpp"

namespace linkwise::bindings {

using namespace nanobind::literals;

namespace nb = nanobind;
using ArrayIn = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using ArrayOut = nb::ndarray<nb::numpy, double>;
using Shape = std::vector<size_t>;

inline std::string shape_text(const Shape& shape) {
  std::string text = "(";
  for (size_t i = 0; i < shape.size(); ++i) text += (i ? ", " : "") + std::to_string(shape[i]);
  return text + (shape.size() == 1 ? ",)" : ")");
}

inline ArrayIn as_array(nb::handle value, const char* name) {
  ArrayIn array;
  if (nb::try_cast(value, array, false)) return array;
  try {
    const nb::object numpy = nb::module_::import_("numpy");
    const nb::object converted =
        numpy.attr("array")(value, "dtype"_a = numpy.attr("float64"), "order"_a = "C");
    return nb::cast<ArrayIn>(converted);
  } catch (nb::python_error&) {
    throw InputError(std::string(name) + " is not an array of numbers; give a float64 array");
  }
}

inline Shape shape_of(const ArrayIn& array) {
  Shape shape(array.ndim());
  for (size_t i = 0; i < array.ndim(); ++i) shape[i] = array.shape(i);
  return shape;
}

/// An argument with its own trailing axes, e.g. (..., nq).
struct Argument {
  const char* name;
  Shape tail;
  ArrayIn array;
  bool given = false;
  const double* data = nullptr;

  Argument(const char* name, Shape tail, nb::handle value) : name(name), tail(std::move(tail)) {
    if (value.is_none()) return;
    given = true;
    array = as_array(value, name);
    check_shape();
    data = array.data();
    for (size_t i = 0; i < array.size(); ++i)
      if (!(data[i] - data[i] == 0))
        throw InputError(std::string(name) + " holds a NaN or infinite value at flat index " +
                         std::to_string(i) + "; give finite numbers");
  }

  Shape lead() const {
    Shape shape = shape_of(array);
    shape.resize(shape.size() - tail.size());
    return shape;
  }

 private:
  void check_shape() const {
    const Shape shape = shape_of(array);
    bool ok = shape.size() >= tail.size();
    for (size_t i = 0; ok && i < tail.size(); ++i)
      ok = shape[shape.size() - tail.size() + i] == tail[i];
    if (ok) return;
    std::string expected = "(...";
    for (size_t n : tail) expected += ", " + std::to_string(n);
    throw InputError(std::string(name) + " has shape " + shape_text(shape) + " but shape " +
                     expected + ") is expected");
  }
};

/// Broadcasts the leading axes of all given arguments against each other, as NumPy does, and points
/// `data` of each at rows of the common shape. Returns that shape.
inline Shape broadcast_leading(std::vector<Argument*> arguments) {
  Shape common;
  bool first = true, same = true;
  for (Argument* a : arguments) {
    if (!a->given) continue;
    const Shape lead = a->lead();
    if (first)
      common = lead;
    else if (lead != common)
      same = false;
    first = false;
  }
  if (same) return common;
  common.clear();
  for (Argument* a : arguments)
    if (a->given && a->lead().size() > common.size()) common.resize(a->lead().size(), 1);
  std::string shapes;
  bool ok = true;
  for (Argument* a : arguments) {
    if (!a->given) continue;
    const Shape lead = a->lead();
    shapes +=
        (shapes.empty() ? "" : ", ") + std::string(a->name) + " " + shape_text(shape_of(a->array));
    for (size_t i = 0; i < lead.size(); ++i) {
      size_t& n = common[common.size() - lead.size() + i];
      if (n == 1)
        n = lead[i];
      else if (lead[i] != 1 && lead[i] != n)
        ok = false;
    }
  }
  if (!ok)
    throw InputError("the leading axes do not broadcast: " + shapes + "; make them equal or 1");
  const nb::object numpy = nb::module_::import_("numpy");
  for (Argument* a : arguments) {
    if (!a->given || a->lead() == common) continue;
    nb::list shape;
    for (size_t n : common) shape.append(n);
    for (size_t n : a->tail) shape.append(n);
    const nb::object wide = numpy.attr("ascontiguousarray")(
        numpy.attr("broadcast_to")(nb::cast(a->array), nb::tuple(shape)));
    a->array = nb::cast<ArrayIn>(wide);
    a->data = a->array.data();
  }
  return common;
}

inline size_t product(const Shape& shape) {
  size_t n = 1;
  for (size_t s : shape) n *= s;
  return n;
}

/// A new array of shape lead + tail.
struct NewArray {
  double* data;
  ArrayOut array;
  NewArray(Shape lead, const Shape& tail) {
    lead.insert(lead.end(), tail.begin(), tail.end());
    data = new double[std::max<size_t>(1, product(lead))];
    nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<double*>(p); });
    array = ArrayOut(data, lead.size(), lead.data(), owner);
  }
};

/// A vector as a new 1-D array.
inline ArrayOut to_numpy(const std::vector<double>& values) {
  NewArray out({values.size()}, {});
  std::copy(values.begin(), values.end(), out.data);
  return out.array;
}

}  // namespace linkwise::bindings
