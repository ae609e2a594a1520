#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "interrupt.hpp"
#include "linkwise/simulate/numerics.hpp"
#include "numbers.hpp"
#include "py_simulation.hpp"
#include "samples.hpp"
#include "solver_options.hpp"
#include "table_rows.hpp"

namespace linkwise::bindings {
namespace {

/// Writes the samples at times; fewer where the simulation ends before.
nb::dict advance(PySimulation& self, nb::handle times_in, nb::handle quantities) {
  Simulation& simulation = self.simulation;
  const ArrayIn times = as_array(times_in, "times");
  const size_t n = times.size();
  const Columns columns(*self.model, {n}, quantities);
  size_t done = 0;
  Interrupt interrupt;
  simulation.set_interrupt([&interrupt] { return interrupt(); });
  try {
    const GilReleased released;
    while (done < n &&
           simulation.advance(times.data()[done], columns.sample.at(*self.model, 0, done)))
      ++done;
  } catch (nb::python_error& error) {  // from a function of the user's
    if (!error.matches(PyExc_KeyboardInterrupt)) throw;
    simulation.stop(Outcome::interrupted);
  }
  simulation.set_interrupt(nullptr);
  interrupt.was_keyboard();
  nb::dict out = columns.to_python(done);
  out["time"] = to_numpy({times.data(), times.data() + done});
  return out;
}

nb::dict trace_columns(const std::vector<EvaluationTrace::Row>& trace) {
  const Shape lead{trace.size()};
  NewArray time(lead), seconds(lead);
  nb::list iterations, accepted;
  for (size_t i = 0; i < trace.size(); ++i) {
    time.data[i] = trace[i].time;
    seconds.data[i] = trace[i].seconds;
    iterations.append(trace[i].iterations);
    accepted.append(trace[i].accepted);
  }
  nb::dict out;
  out["time"] = time.array;
  out["seconds"] = seconds.array;
  out["iterations"] = numpy("array")(iterations, "dtype"_a = "int64");
  out["accepted"] = numpy("array")(accepted, "dtype"_a = "bool");
  return out;
}

/// Options by the names of the table, and solver_options and threads.
SimulationOptions options_of(const nb::kwargs& given) {
  Numerics numerics;
  nb::object solver_options = nb::none();
  std::optional<int> threads;
  for (auto [key, value] : given) {
    const std::string name = nb::cast<std::string>(key);
    if (name == "solver_options") {
      solver_options = nb::borrow(value);
    } else if (name == "threads") {
      threads = whole_number(value, "threads");
    } else {
      std::visit(
          [&, value = value](auto member) {
            using Value = std::remove_reference_t<decltype(numerics.*member)>;
            if (!nb::try_cast(value, numerics.*member))
              throw InputError(
                  name + " is " + nb::cast<std::string>(nb::repr(value)) + "; give " +
                  (std::is_same_v<Value, std::string> ? "a name in quotes" : "a number"));
          },
          find_numerics(name).member);
    }
  }
  return simulation_options(numerics, executor_for(threads), solver_option_values(solver_options));
}

nb::list numerics_list() {
  const Numerics defaults;
  return table_rows(numerics_table(), [&](auto&& row, const NumericsEntry& e) {
    row("name", e.name);
    std::visit([&](auto member) { row("default", nb::cast(defaults.*member)); }, e.member);
    row("units", e.units);
    row("kind", e.kind());
    row("description", e.description);
  });
}

nb::list quantity_list() {
  return table_rows(quantity_table(), [](auto&& row, const QuantityEntry& e) {
    row("name", e.name);
    row("group", e.group);
    row("axis", to_string(e.axis));
    row("units", e.units);
    row("long_name", e.long_name);
    row("frame", e.frame);
    row("point", e.point);
    row("convention", e.convention);
    row("is_count", e.count != nullptr);
    row("of_members", e.of_members);
  });
}

void bind_ending(nb::module_& m) {
  nb::class_<Ending>(m, "Ending", "How a simulation ended, or that it goes on (converged).")
      .def_prop_ro("outcome", [](const Ending& e) { return std::string(to_string(e.outcome)); })
      .def_ro("time", &Ending::time, "The time that was reached, s.")
      .def_ro("joint", &Ending::joint, "Where it failed, or empty.")
      .def_ro("text", &Ending::text, "What happened and what to do about it, or empty.");
  nb::class_<SimulationStatistics>(m, "SimulationStatistics", "Since the start.")
      .def_ro("steps", &SimulationStatistics::steps)
      .def_ro("evaluations", &SimulationStatistics::evaluations)
      .def_ro("iterations", &SimulationStatistics::iterations)
      .def_ro("solver_error", &SimulationStatistics::solver_error,
              "Largest error that the forces of an iterative solver can have had, in the A-norm "
              "and relative to them; infinite where it is not bounded.");
}

int traverse(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  return nb::inst_ready(self) ? nb::inst_ptr<PySimulation>(self)->traverse(visit, arg) : 0;
}

int clear(PyObject* self) {
  nb::inst_ptr<PySimulation>(self)->clear();
  return 0;
}

PyType_Slot collected[] = {{Py_tp_traverse, reinterpret_cast<void*>(traverse)},
                           {Py_tp_clear, reinterpret_cast<void*>(clear)},
                           {0, nullptr}};

void bind_drives(nb::class_<PySimulation>& simulation) {
  simulation.def("drive_torque", &PySimulation::torque, "joint"_a, "values"_a)
      .def("drive_torque_table", &PySimulation::torque_table, "joint"_a, "times"_a, "values"_a,
           "interpolation"_a = "linear", "smooth"_a = false)
      .def("drive_torque_callable", &PySimulation::torque_callable, "joint"_a, "fn"_a,
           "breakpoints"_a = nb::none(), "samples"_a = nb::none())
      .def("drive_motion_table", &PySimulation::motion_table, "joint"_a, "times"_a, "values"_a,
           "interpolation"_a = "cubic")
      .def("drive_motion_callable", &PySimulation::motion_callable, "joint"_a, "fn"_a,
           "breakpoints"_a = nb::none(), "samples"_a = nb::none())
      .def("drive_pd", &PySimulation::pd, "joint"_a, "kp"_a, "kd"_a, "target"_a)
      .def("drive_pd_table", &PySimulation::pd_table, "joint"_a, "kp"_a, "kd"_a, "times"_a,
           "values"_a, "interpolation"_a = "linear")
      .def("drive_locked", &PySimulation::locked, "joint"_a)
      .def("drive_free", &PySimulation::free, "joint"_a)
      .def("wrench", &PySimulation::wrench, "at"_a, "value"_a, "axes"_a = "world")
      .def("wrench_table", &PySimulation::wrench_table, "at"_a, "times"_a, "values"_a,
           "interpolation"_a = "linear", "axes"_a = "world")
      .def("wrench_callable", &PySimulation::wrench_callable, "at"_a, "fn"_a, "axes"_a = "world",
           "breakpoints"_a = nb::none(), "samples"_a = nb::none());
}

void bind_doubts(nb::class_<PySimulation>& simulation) {
  simulation
      .def_prop_ro(
          "stiffness", [](const PySimulation& s) { return s.simulation.stiffness(); },
          "Since when the motion is stiff and what follows, one line; empty where nothing was "
          "noticed.")
      .def_prop_ro(
          "force_doubt", [](const PySimulation& s) { return s.simulation.force_doubt(); },
          "Where gains make too much force of the errors of steps, one line; empty: nowhere.")
      .def_prop_ro(
          "loop_doubt", [](const PySimulation& s) { return s.simulation.loop_doubt(); },
          "Where loads of closed loops have no bound, one line; empty: nowhere.")
      .def_prop_ro("knows_works", [](const PySimulation& s) { return s.simulation.knows_works(); });
}

}  // namespace

void bind_simulation(nb::module_& m) {
  bind_ending(m);
  nb::class_<PySimulation> simulation(
      m, "Simulation", nb::type_slots(collected),
      "The compiled time loop behind linkwise.simulate: Simulation(model, **options), options by "
      "the names of\n"
      "numerics(), and solver_options and threads.");
  simulation
      .def(
          "__init__",
          [](PySimulation* self, const PyModel& model, const nb::kwargs& options) {
            new (self) PySimulation(model, options_of(options));
          },
          "model"_a, "options"_a)
      .def("start", &PySimulation::start, "t0"_a, "q0"_a, "v0"_a,
           "hold"_a = std::vector<std::string>(),
           "loop_rates"_a = std::vector<std::pair<std::string, std::vector<double>>>())
      .def_prop_ro(
          "assembled", [](const PySimulation& s) { return s.simulation.assembled(); },
          "What closing the loops changed at the start, one line; empty: nothing.")
      .def_prop_ro(
          "start_position",
          [](const PySimulation& s) {
            const auto& state = s.simulation.start_state();
            return to_numpy({state.begin(), state.begin() + s.model->nq()});
          },
          "Coordinates (nq,) that it started from, loops closed.")
      .def("advance", &advance, "times"_a, "quantities"_a = nb::none(),
           "The samples at times [s], which increase: a dictionary of the time and of the arrays "
           "(time, ...) of\n"
           "the wanted quantities. Fewer where the simulation ends before: see ending.")
      .def("keep_extremes", &PySimulation::keep_extremes, "directions"_a,
           "From the next start on, keep the extremes between samples; directions of the joints' "
           "axes (joint, 3) in the joint frames, NaN where there is no single one.")
      .def("extremes", &PySimulation::extremes,
           "What was found until the last time advanced to, as one flat array: see the core's "
           "Extremes::size.")
      .def_prop_ro("ending", [](const PySimulation& s) { return s.simulation.ending(); })
      .def(
          "interrupt", [](PySimulation& s) { s.simulation.stop(Outcome::interrupted); },
          "End what still runs.")
      .def_prop_ro("statistics", [](const PySimulation& s) { return s.simulation.statistics(); })
      .def(
          "keep_trace",
          [](PySimulation& s, bool wanted) {
            s.simulation.set_observer(wanted ? &s.trace : nullptr);
          },
          "wanted"_a = true,
          "From the next start on, record every evaluation that the integrator asks for.")
      .def(
          "trace", [](const PySimulation& s) { return trace_columns(s.trace.rows()); },
          "The evaluations so far, one array entry each: simulated time, seconds spent, "
          "iterations, and whether the step that it ended was accepted.")
      .def_prop_ro(
          "velocity_drift",
          [](const PySimulation& s) {
            const IntegratedState* state = s.simulation.integrated_state();
            return state ? state->drift() : 0.0;
          },
          "State body_velocities: how far joints come apart at the last sample, m/s or rad/s.")
      .def_prop_ro(
          "step_tolerance",
          [](const PySimulation& s) { return s.simulation.setup().options.integration.tolerance; })
      .def_prop_ro("method",
                   [](const PySimulation& s) { return s.simulation.setup().choice.method; })
      .def_prop_ro("solver",
                   [](const PySimulation& s) { return s.simulation.setup().choice.solver; })
      .def_prop_ro("reason",
                   [](const PySimulation& s) { return s.simulation.setup().choice.reason; });
  bind_drives(simulation);
  bind_doubts(simulation);
  m.def("numerics", &numerics_list,
        "The options of Simulation, as dictionaries of name, default, units, kind (number, count, "
        "name) and description.");
  m.def(
      "peak_state_size", [](const PyModel& model) { return Extremes::state_size(*model.model); },
      "model"_a, "Numbers of each state that extremes hold of a peak; none of large machines.");
  m.def("quantities", &quantity_list, "The table of recorded quantities, as dictionaries.");
}

}  // namespace linkwise::bindings
