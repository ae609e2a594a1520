#include <cstdlib>

#include <nanobind/nanobind.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "linkwise/base/error.hpp"
#include "printable.hpp"

namespace nb = nanobind;
using namespace nanobind::literals;

NB_MODULE(LINKWISE_MODULE_NAME, m) {
  // Classes say that they live in linkwise._core, which re-exports this module: a pickled model
  // must open on a machine that picks another CPU target.
  const nb::object module_name = m.attr("__name__");
  m.attr("__name__") = "linkwise._core";

  // A thread that outlives the interpreter keeps its objects, which users need not hear of; tests
  // do.
  nb::set_leak_warnings(std::getenv("LINKWISE_LEAK_WARNINGS") != nullptr);
  linkwise::bindings::find_numpy();
  m.attr("cpu_target") = LINKWISE_CPU_TARGET;
  m.attr("lanes") = LINKWISE_LANES;
  linkwise::bindings::bind_exception<linkwise::InputError>(
      m, "InputError", PyExc_ValueError,
      "What was given cannot be used: one line with the element and the remedy.");
  m.def(
      "as_floats",
      [](nb::handle values, const std::string& name) {
        return linkwise::bindings::as_array(values, name.c_str()).object();
      },
      "values"_a, "name"_a,
      R"(The values as a float64 array, C-contiguous: the same one where it is one already.

Raises:
    InputError: complex numbers, truth values, text, dates, records, objects, masked values. NumPy
        would turn most of them into numbers without a word.)");
  auto builder = linkwise::bindings::bind_builder(m);
  linkwise::bindings::bind_frame(m);
  linkwise::bindings::bind_model(m, builder);
  linkwise::bindings::bind_loop_gaps(m);
  linkwise::bindings::bind_dynamics(m);
  linkwise::bindings::bind_inverse(m);
  linkwise::bindings::bind_causes(m);
  linkwise::bindings::bind_indeterminacy(m);
  linkwise::bindings::bind_kinematics(m);
  linkwise::bindings::bind_sections(m);
  linkwise::bindings::bind_simulation(m);
  linkwise::bindings::bind_batch_simulation(m);
  linkwise::bindings::bind_solve(m);
  linkwise::bindings::bind_paper(m);
  linkwise::bindings::tell_wrong_arguments_on_one_line(m);

  m.attr("__name__") = module_name;
}
