#pragma once
// Single numbers from Python. Anything else is refused in one line, as arrays are.
#include <climits>
#include <optional>

#include "arrays.hpp"

namespace linkwise::bindings {

/// A whole number of Python or NumPy, nothing for None. True and 2.0 are refused.
inline std::optional<int> whole_number(nb::handle value, const char* name) {
  if (value.is_none()) return std::nullopt;
  if (!nb::isinstance<nb::bool_>(value) && PyIndex_Check(value.ptr())) {
    const Py_ssize_t found = PyNumber_AsSsize_t(value.ptr(), nullptr);  // clipped, if too large
    if (found >= INT_MIN && found <= INT_MAX && !PyErr_Occurred()) return static_cast<int>(found);
    PyErr_Clear();
  }
  throw InputError(std::string(name) + " is " + nb::cast<std::string>(nb::str(nb::repr(value))) +
                   "; give a whole number below 2^31");
}

/// A name from a table of the core.
inline std::string name_in(nb::handle value, const char* name) {
  if (nb::isinstance<nb::str>(value)) {
    const char* text = PyUnicode_AsUTF8(value.ptr());
    if (text) return text;
    PyErr_Clear();  // half of a character
  }
  throw InputError(std::string(name) + " is " + nb::cast<std::string>(nb::str(nb::repr(value))) +
                   "; give a name in quotes");
}

/// A real number of Python or NumPy.
inline double real_number(nb::handle value, const char* name) {
  if (PyFloat_Check(value.ptr())) return PyFloat_AS_DOUBLE(value.ptr());
  const ArrayIn array = as_array(value, name);
  if (array.ndim() != 0)
    throw InputError(std::string(name) + " has shape " + shape_text(shape_of(array)) +
                     "; give one number");
  return *array.data();
}

}  // namespace linkwise::bindings
