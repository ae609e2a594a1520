// Arguments that fit no function are told on one line, where nanobind takes several.
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <nanobind/nanobind.h>

#include "bind.hpp"

namespace nb = nanobind;

namespace linkwise::bindings {
namespace {

/// What the functions of the module call themselves. They live as long as the process.
std::unordered_map<PyObject*, vectorcallfunc>& own_calls() {
  static auto* calls = new std::unordered_map<PyObject*, vectorcallfunc>;
  return *calls;
}

vectorcallfunc& call_of(PyObject* function) {
  char* object = reinterpret_cast<char*>(function);
  return *reinterpret_cast<vectorcallfunc*>(object + Py_TYPE(function)->tp_vectorcall_offset);
}

void erase_all(std::string& text, std::string_view part) {
  for (size_t at; (at = text.find(part)) != std::string::npos;) text.erase(at, part.size());
}

std::string between(const std::string& text, std::string_view begin, std::string_view end) {
  const size_t first = text.find(begin);
  if (first == std::string::npos) return {};
  const size_t from = first + begin.size(), to = text.find(end, from);
  return text.substr(from, to == std::string::npos ? to : to - from);
}

/// `NAME(): takes (...), was given (...)`; empty where the text is another complaint.
std::string on_one_line(std::string text) {
  if (text.find("(): incompatible function arguments") == std::string::npos) return {};
  for (const char* noise : {"linkwise._core.", "collections.abc.", ": object | None", ": object"})
    erase_all(text, noise);
  std::string name = text.substr(0, text.find("()"));
  std::string takes = between(text, "1. " + name + "(", "\n");
  takes = takes.substr(0, takes.rfind(')'));
  std::string given = between(text, "Invoked with types: ", "\n");
  if (takes.rfind("self", 0) == 0) {  // the object is no argument of the caller's
    takes.erase(0, takes.find_first_of(", ") == 4 ? 6 : 4);
    const std::string own = given.substr(0, given.find(", "));
    given.erase(0, own.size() + 2);
    name = name == "__init__" ? own : own + "." + name;
  }
  return name + "(): takes (" + takes + "), was given (" + given + ")";
}

PyObject* call(PyObject* function, PyObject* const* arguments, size_t count, PyObject* names) {
  PyObject* result = own_calls().find(function)->second(function, arguments, count, names);
  if (result || !PyErr_ExceptionMatches(PyExc_TypeError)) return result;
  nb::python_error error;
  const std::string line = on_one_line(nb::cast<std::string>(nb::str(error.value())));
  if (line.empty())
    error.restore();
  else
    PyErr_SetString(PyExc_TypeError, line.c_str());
  return nullptr;
}

void watch(nb::handle holder) {
  nb::object names(holder.attr("__dict__"));  // a class has a view of it
  const nb::dict held = nb::steal<nb::dict>(
      PyObject_CallOneArg(reinterpret_cast<PyObject*>(&PyDict_Type), names.ptr()));
  for (auto [name, value] : held) {
    const std::string_view type = Py_TYPE(value.ptr())->tp_name;
    if (type.find("nb_func") == std::string_view::npos &&
        type.find("nb_method") == std::string_view::npos)
      continue;
    vectorcallfunc& own = call_of(value.ptr());
    if (own != call) own_calls().emplace(value.ptr(), std::exchange(own, call));
  }
}

}  // namespace

void tell_wrong_arguments_on_one_line(nb::module_& m) {
  watch(m);
  const nb::dict held = nb::cast<nb::dict>(m.attr("__dict__"));
  for (auto [name, value] : held)
    if (nb::isinstance<nb::type_object>(value)) watch(value);
}

}  // namespace linkwise::bindings
