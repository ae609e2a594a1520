#pragma once
// What a message holds may come from a file of somebody else, and ends on a terminal.
#include <string>
#include <string_view>

#include <nanobind/nanobind.h>

namespace linkwise::bindings {

/// UTF-8 with its control characters written as escapes: C0, DEL and C1.
inline std::string printable(std::string_view text) {
  static constexpr char digits[] = "0123456789abcdef";
  std::string shown;
  for (size_t i = 0; i < text.size(); ++i) {
    unsigned char c = static_cast<unsigned char>(text[i]);
    const bool c1 = c == 0xc2 && i + 1 < text.size() &&
                    static_cast<unsigned char>(text[i + 1]) >= 0x80 &&
                    static_cast<unsigned char>(text[i + 1]) < 0xa0;
    if (c1) c = static_cast<unsigned char>(text[++i]);
    if (c1 || c < 0x20 || c == 0x7f)
      (shown += "\\x") += {digits[c >> 4], digits[c & 15]};
    else
      shown += text[i];
  }
  return shown;
}

/// The two ends of a message that a name of many characters has made too long to read.
inline std::string shortened(std::string text) {
  constexpr size_t longest = 4000, head = 3000, tail = 500;
  const auto at_character = [&](size_t i) {
    while (i < text.size() && (static_cast<unsigned char>(text[i]) & 0xc0) == 0x80) ++i;
    return i;
  };
  if (text.size() <= longest) return text;
  return text.substr(0, at_character(head)) + " ... " +
         text.substr(at_character(text.size() - tail));
}

/// Raises a Python exception of this type with a message of the core. Bytes that are no text, which
/// a damaged file may bring, do not hide it.
inline void raise_printable(PyObject* type, const char* message) {
  const std::string shown = shortened(printable(message));
  PyObject* text =
      PyUnicode_DecodeUTF8(shown.data(), static_cast<Py_ssize_t>(shown.size()), "backslashreplace");
  if (!text) return;
  PyErr_SetObject(type, text);
  Py_DECREF(text);
}

/// Makes a Python exception of the C++ class Error, whose messages are printed as users may see
/// them.
template <class Error>
void bind_exception(nanobind::module_& m, const char* name, PyObject* base, const char* doc) {
  nanobind::exception<Error> bound(m, name, base);
  bound.attr("__module__") = "linkwise";
  bound.attr("__doc__") = doc;
  nanobind::register_exception_translator(
      [](const std::exception_ptr& thrown, void* type) {
        try {
          std::rethrow_exception(thrown);
        } catch (const Error& error) {
          raise_printable(static_cast<PyObject*>(type), error.what());
        }
      },
      bound.ptr());
}

}  // namespace linkwise::bindings
