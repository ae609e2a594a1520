#pragma once
// NumPy arrays in and out: float64 rows with any leading axes. Anything else that NumPy can turn
// into such an array (lists, integers, other strides) is turned; the common case costs no Python
// call on the way in, one on the way out, and no allocation of its own.
#include <algorithm>
#include <bit>
#include <cstring>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "linkwise/base/error.hpp"
#include "linkwise/base/memory.hpp"

namespace linkwise::bindings {

using namespace nanobind::literals;

namespace nb = nanobind;

/// Lengths of axes, outermost first.
class Shape {
 public:
  static constexpr size_t max_axes = 16;
  Shape() = default;
  Shape(std::initializer_list<size_t> lengths) {
    for (const size_t n : lengths) append(n);
  }
  void append(size_t n) {
    if (size_ == max_axes) throw InputError("an array has more than 16 axes; give fewer");
    lengths_[size_++] = n;
  }
  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  size_t& operator[](size_t i) { return lengths_[i]; }
  size_t operator[](size_t i) const { return lengths_[i]; }
  const size_t* begin() const { return lengths_; }
  const size_t* end() const { return lengths_ + size_; }
  bool operator==(const Shape& other) const {
    return std::equal(begin(), end(), other.begin(), other.end());
  }
  /// The first n axes.
  Shape head(size_t n) const {
    Shape out;
    for (size_t i = 0; i < n; ++i) out.append(lengths_[i]);
    return out;
  }
  Shape operator+(const Shape& tail) const {
    Shape out = *this;
    for (const size_t n : tail) out.append(n);
    return out;
  }

 private:
  size_t size_ = 0;
  size_t lengths_[max_axes];
};

inline size_t product(const Shape& shape) {
  size_t n = 1;
  for (const size_t s : shape) n *= s;
  return n;
}

inline std::string shape_text(const Shape& shape) {
  std::string text = "(";
  for (size_t i = 0; i < shape.size(); ++i) text += (i ? ", " : "") + std::to_string(shape[i]);
  return text + (shape.size() == 1 ? ",)" : ")");
}

inline nb::tuple to_tuple(const Shape& shape) {
  nb::tuple lengths = nb::steal<nb::tuple>(PyTuple_New(static_cast<Py_ssize_t>(shape.size())));
  for (size_t i = 0; i < shape.size(); ++i)
    PyTuple_SET_ITEM(lengths.ptr(), static_cast<Py_ssize_t>(i), PyLong_FromSize_t(shape[i]));
  return lengths;
}

/// A view of an array's numbers. Made and destroyed with the GIL held.
class ArrayIn {
 public:
  ArrayIn() = default;
  ArrayIn(ArrayIn&& other) noexcept : view_(std::exchange(other.view_, {})) {}
  ArrayIn& operator=(ArrayIn&& other) noexcept {
    std::swap(view_, other.view_);
    return *this;
  }
  ~ArrayIn() { PyBuffer_Release(&view_); }

  /// Takes contiguous float64 numbers; false for anything else.
  bool open(nb::handle value) {
    if (PyObject_GetBuffer(value.ptr(), &view_, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) != 0) {
      PyErr_Clear();
      view_ = {};
      return false;
    }
    if (view_.format && is_double(view_.format)) return true;
    PyBuffer_Release(&view_);
    return false;
  }

  size_t ndim() const { return view_.ndim; }
  size_t shape(size_t i) const { return view_.shape[i]; }
  size_t size() const { return view_.len / sizeof(double); }
  const double* data() const { return static_cast<const double*>(view_.buf); }
  double* writable() const { return static_cast<double*>(view_.buf); }
  nb::object object() const { return nb::borrow<nb::object>(nb::handle(view_.obj)); }

 private:
  /// Zarr's arrays say their byte order, which NumPy's copies of them then do too.
  static bool is_double(const char* format) {
    const char order = std::endian::native == std::endian::little ? '<' : '>';
    if (*format == '@' || *format == '=' || *format == order) ++format;
    return std::strcmp(format, "d") == 0;
  }

  Py_buffer view_{};
};

inline nb::object numpy(const char* name) { return nb::module_::import_("numpy").attr(name); }

inline ArrayIn as_array(nb::handle value, const char* name) {
  ArrayIn array;
  if (array.open(value)) return array;
  try {
    const nb::object converted =
        numpy("array")(value, "dtype"_a = numpy("float64"), "order"_a = "C");
    if (array.open(converted)) return array;
  } catch (nb::python_error& error) {
    if (error.matches(PyExc_MemoryError)) throw;
  }
  throw InputError(std::string(name) + " is not an array of numbers; give a float64 array");
}

inline Shape shape_of(const ArrayIn& array) {
  Shape shape;
  for (size_t i = 0; i < array.ndim(); ++i) shape.append(array.shape(i));
  return shape;
}

/// An argument with its own trailing axes, e.g. (..., nq).
struct Argument {
  const char* name;
  Shape tail;
  ArrayIn array;
  bool given = false;
  const double* data = nullptr;

  Argument(const char* name, const Shape& tail, nb::handle value) : name(name), tail(tail) {
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

  Shape lead() const { return shape_of(array).head(array.ndim() - tail.size()); }

 private:
  void check_shape() const {
    bool ok = array.ndim() >= tail.size();
    for (size_t i = 0; ok && i < tail.size(); ++i)
      ok = array.shape(array.ndim() - tail.size() + i) == tail[i];
    if (ok) return;
    std::string expected = "(...";
    for (const size_t n : tail) expected += ", " + std::to_string(n);
    throw InputError(std::string(name) + " has shape " + shape_text(shape_of(array)) +
                     " but shape " + expected + ") is expected");
  }
};

/// Broadcasts the leading axes of all given arguments against each other, as NumPy does, and points
/// `data` of each at rows of the common shape. Returns that shape.
inline Shape broadcast_leading(std::initializer_list<Argument*> arguments) {
  Shape common;
  bool several = false;
  for (const Argument* a : arguments) several |= a->given && a->array.ndim() > a->tail.size();
  if (!several) return common;
  std::string shapes;
  bool ok = true, same = true;
  for (const Argument* a : arguments) {
    if (!a->given) continue;
    shapes +=
        (shapes.empty() ? "" : ", ") + std::string(a->name) + " " + shape_text(shape_of(a->array));
    const Shape lead = a->lead();
    Shape wide;  // common, with ones in front
    for (size_t i = common.size(); i < lead.size(); ++i) wide.append(1);
    common = wide + common;
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
  double copies = 0;
  for (const Argument* a : arguments) {
    if (!a->given || a->lead() == common) continue;
    same = false;
    copies += 8.0 * product(common) * product(a->tail);
  }
  if (same) return common;
  if (copies > worth_a_check)
    require_memory(copies, "arguments broadcast to leading axes " + shape_text(common));
  for (Argument* a : arguments) {
    if (!a->given || a->lead() == common) continue;
    const nb::object rows = numpy("broadcast_to")(a->array.object(), to_tuple(common + a->tail));
    a->array = as_array(numpy("ascontiguousarray")(rows), a->name);
    a->data = a->array.data();
  }
  return common;
}

/// A new array of shape lead + tail.
struct NewArray {
  nb::object array;
  double* data;
  explicit NewArray(const Shape& lead, const Shape& tail = {}) {
    const Shape shape = lead + tail;
    double bytes = 8;
    for (const size_t n : shape) bytes *= static_cast<double>(n);
    if (bytes > worth_a_check) require_memory(bytes, "a result of shape " + shape_text(shape));
    // Kept for the life of the process: looking it up costs as much as making the array.
    static const nb::handle empty = numpy("empty").release();
    array = shape.size() == 1 ? empty(shape[0]) : empty(to_tuple(shape));
    view_.open(array);
    data = view_.writable();
  }

 private:
  ArrayIn view_;
};

/// A vector as a new 1-D array.
inline nb::object to_numpy(const std::vector<double>& values) {
  NewArray out({values.size()});
  std::copy(values.begin(), values.end(), out.data);
  return out.array;
}

}  // namespace linkwise::bindings
