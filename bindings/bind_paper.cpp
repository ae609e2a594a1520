// What `linkwise paper` times inside an evaluation, and nothing else uses.
#include <chrono>

#include <nanobind/nanobind.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "linkwise/paper/serial_part.hpp"
#include "py_model.hpp"

namespace linkwise::bindings {
namespace {

/// Seconds of one of `repeats` calls.
template <class Call>
double seconds_each(int repeats, Call&& call) {
  const auto started = std::chrono::steady_clock::now();
  for (int k = 0; k < repeats; ++k) call();
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - started;
  return spent.count() / repeats;
}

nb::dict measure_serial_part(const PyModel& self, nb::handle q, nb::handle v, int sums,
                             int repeats) {
  if (sums < 0 || repeats < 1) throw InputError("sums must be >= 0 and repeats >= 1");
  const Model& model = *self.model;
  const Argument positions("q", {static_cast<size_t>(model.nq())}, q);
  const Argument rates("v", {static_cast<size_t>(model.nv())}, v);
  if (!positions.given || !rates.given) throw InputError("q or v is missing; give both");
  SerialPart part(model, positions.data, rates.data);
  nb::dict seconds;
  seconds["sums"] = seconds_each(repeats, [&] { part.add(sums); });
  seconds["velocities"] = seconds_each(repeats, [&] { part.pass_velocities(); });
  return seconds;
}

}  // namespace

void bind_paper(nb::module_& m) {
  m.def("measure_serial_part", &measure_serial_part, "model"_a, "q"_a, "v"_a, nb::kw_only(),
        "sums"_a, "repeats"_a = 1000,
        "Seconds of what no number of processors shortens in an evaluation by constraint forces:\n"
        "adding one number per body `sums` times, and passing the velocities from body to body.");
}

}  // namespace linkwise::bindings
