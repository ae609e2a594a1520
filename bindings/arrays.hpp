#pragma once
// NumPy arrays in and out: float64 rows with any leading axes. Anything else that NumPy can convert
// (lists, integers, other strides) is converted. The common case costs no Python call.
#include <algorithm>
#include <bit>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "gil.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/base/finite.hpp"
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

inline PythonFunction python_function(const char* module, const char* name) {
  return PythonFunction(nb::module_::import_(module).attr(name));
}
inline PythonFunction numpy(const char* name) { return python_function("numpy", name); }

/// How NumPy's arrays and their dtypes begin, in all its versions. Reading it takes some
/// nanoseconds; the buffer protocol takes 150, as much as the dynamics of two bodies.
struct NumpyDtype {
  PyObject_HEAD PyObject* typeobj;
  char kind, type, byteorder, flags;
  int type_num;
};
struct NumpyArray {
  PyObject_HEAD char* data;
  int nd;
  Py_ssize_t *dimensions, *strides;
  PyObject* base;
  NumpyDtype* descr;
  int flags;
};

inline constexpr int numpy_float64 = 12;

/// What compiled code needs of NumPy. Looking it up costs more than the dynamics of a small
/// machine.
struct NumpyTable {
  PyTypeObject* array_type;
  PyObject* (*new_array)(PyTypeObject*, int, const Py_ssize_t*, int, const Py_ssize_t*, void*, int,
                         int, PyObject*);  ///< PyArray_New: a third of the time of numpy.empty
};
inline NumpyTable numpy_table{};

/// Once, by the import of the module: in the middle of calls, two threads could wait for each
/// other, one for this and one for the GIL.
inline void find_numpy() {
  const nb::module_ module = nb::module_::import_("numpy");
  const bool old = nb::cast<std::string>(module.attr("__version__")).starts_with("1.");
  const nb::object functions =
      nb::module_::import_(old ? "numpy.core._multiarray_umath" : "numpy._core._multiarray_umath")
          .attr("_ARRAY_API");
  const auto* table = static_cast<void**>(PyCapsule_GetPointer(functions.ptr(), nullptr));
  if (!table) throw nb::python_error();
  numpy_table.new_array = reinterpret_cast<decltype(numpy_table.new_array)>(table[93]);
  // Kept for the life of the process.
  numpy_table.array_type =
      reinterpret_cast<PyTypeObject*>(nb::object(module.attr("ndarray")).release().ptr());
}

/// A new array of float64.
inline PyObject* make_numpy(const Shape& shape) {
  Py_ssize_t lengths[Shape::max_axes];
  std::copy(shape.begin(), shape.end(), lengths);
  PyObject* made = numpy_table.new_array(numpy_table.array_type, static_cast<int>(shape.size()),
                                         lengths, numpy_float64, nullptr, nullptr, 0, 0, nullptr);
  if (!made) throw nb::python_error();
  return made;
}

/// An array of float64, contiguous and in this machine's byte order, and the reference that keeps
/// it.
class ArrayIn {
 public:
  ArrayIn() = default;

  /// False for anything else, kinds of arrays that may hide something (masks) included.
  bool open(nb::handle value) {
    if (Py_TYPE(value.ptr()) != numpy_table.array_type) return false;
    constexpr int contiguous = 0x1, aligned = 0x100;
    constexpr char foreign = std::endian::native == std::endian::little ? '>' : '<';
    const auto* found = reinterpret_cast<const NumpyArray*>(value.ptr());
    if (found->descr->type_num != numpy_float64 || found->descr->byteorder == foreign ||
        (found->flags & (contiguous | aligned)) != (contiguous | aligned))
      return false;
    owner_ = nb::borrow(value);
    return true;
  }

  size_t ndim() const { return array().nd; }
  size_t shape(size_t i) const { return array().dimensions[i]; }
  size_t size() const {
    size_t n = 1;
    for (size_t i = 0; i < ndim(); ++i) n *= shape(i);
    return n;
  }
  const double* data() const { return reinterpret_cast<const double*>(array().data); }
  const nb::object& object() const { return owner_; }

 private:
  const NumpyArray& array() const { return *reinterpret_cast<const NumpyArray*>(owner_.ptr()); }
  nb::object owner_;
};

/// What an array holds that is no real number, by the kind of its dtype; null for real numbers.
inline const char* unreal_values(char kind) {
  switch (kind) {
    case 'f':
    case 'i':
    case 'u':
      return nullptr;
    case 'b':
      return "truth values";
    case 'c':
      return "complex numbers";
    case 'm':
    case 'M':
      return "times or dates";
    case 'S':
    case 'U':
    case 'T':
      return "text";
    case 'V':
      return "records";
    default:
      return "objects";
  }
}

/// Is an entry of a list, or of lists within it, NumPy's constant for a masked value? NumPy would
/// make a NaN of it.
inline bool holds_masked(nb::handle value, size_t depth = 0) {
  if (depth > Shape::max_axes) return false;
  PyObject* const o = value.ptr();
  if (!PyList_CheckExact(o) && !PyTuple_CheckExact(o))
    return std::string_view(Py_TYPE(o)->tp_name) == "MaskedConstant";
  for (Py_ssize_t i = 0; i < PySequence_Fast_GET_SIZE(o); ++i)
    if (holds_masked(PySequence_Fast_GET_ITEM(o, i), depth + 1)) return true;
  return false;
}

/// `value` as an array of float64. Whatever else NumPy would turn into numbers is refused: it would
/// drop imaginary parts and masks, and read texts and dates.
inline ArrayIn as_array(nb::handle value, const char* name) {
  ArrayIn array;
  if (array.open(value)) return array;
  const char* found = holds_masked(value) ? "masked values" : nullptr;
  try {
    if (!found) {
      const nb::object given = numpy("asarray")(value);
      if (PyObject_TypeCheck(value.ptr(), numpy_table.array_type) &&
          nb::cast<bool>(python_function("numpy.ma", "is_masked")(value)))
        found = "masked values";
      else
        found = unreal_values(reinterpret_cast<const NumpyArray*>(given.ptr())->descr->kind);
      if (!found && array.open(numpy("array")(given, "dtype"_a = "float64", "order"_a = "C")))
        return array;
    }
  } catch (nb::python_error& error) {
    if (error.matches(PyExc_MemoryError)) throw;
  }
  throw InputError(
      std::string(name) +
      (found ? " holds " + std::string(found) : std::string(" is not an array of numbers")) +
      "; give a float64 array");
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
    if (all_finite({data, array.size()})) return;
    const double* bad = data;
    while (*bad - *bad == 0) ++bad;
    throw InputError(std::string(name) + " holds a NaN or infinite value at flat index " +
                     std::to_string(bad - data) + "; give finite numbers");
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
    array = nb::steal(make_numpy(shape));
    data = reinterpret_cast<double*>(reinterpret_cast<NumpyArray*>(array.ptr())->data);
  }
};

/// What only describes an object: writing into it would change a copy without a word, and is
/// refused.
inline nb::object read_only(nb::object array) {
  constexpr int writeable = 0x400;
  reinterpret_cast<NumpyArray*>(array.ptr())->flags &= ~writeable;
  return array;
}

/// A vector as a new 1-D array.
inline nb::object to_numpy(const std::vector<double>& values) {
  NewArray out({values.size()});
  std::copy(values.begin(), values.end(), out.data);
  return out.array;
}

}  // namespace linkwise::bindings
