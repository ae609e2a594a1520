#include <set>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "bind.hpp"
#include "interrupt.hpp"
#include "linkwise/exec/thread_pool.hpp"
#include "linkwise/solve/registry.hpp"
#include "py_simulation.hpp"
#include "solver_options.hpp"

namespace linkwise::bindings {
namespace {

nb::dict advance(PySimulation& self, nb::handle times_in, const nb::object& quantities) {
  Simulation& simulation = self.simulation;
  const Model* model = self.model.get();
  const ArrayIn times = as_array(times_in, "times");
  const size_t n = times.size();
  const size_t nq = model->nq(), nv = model->nv(), nj = model->n_joints();
  std::set<std::string> wanted;
  if (quantities.is_none())
    wanted = {"position", "velocity", "acceleration", "joint_load", "drive_torque", "energy"};
  else
    for (nb::handle item : quantities) wanted.insert(nb::cast<std::string>(item));
  const auto column = [&](const char* name, const Shape& tail) -> std::unique_ptr<NewArray> {
    if (!wanted.count(name)) return nullptr;
    Shape lead{n};
    return std::make_unique<NewArray>(lead, tail);
  };
  auto position = column("position", {nq}), velocity = column("velocity", {nv}),
       acceleration = column("acceleration", {nv});
  auto load = column("joint_load", {nj, 6}), torque = column("drive_torque", {nv});
  auto external = column("external_wrench", {nj, 6});
  auto kinetic = column("energy", {}), potential = column("energy", {});
  std::vector<std::array<double, 5>> statistics;
  size_t done = 0;
  bool interrupted = false;
  Interrupt interrupt;
  simulation.set_interrupt([&interrupt] { return interrupt(); });
  try {
    const nb::gil_scoped_release release;
    for (; done < n; ++done) {
      Sample s;
      const auto row = [&](const std::unique_ptr<NewArray>& a, size_t width) {
        return a ? a->data + done * width : nullptr;
      };
      s.position = row(position, nq);
      s.velocity = row(velocity, nv);
      s.acceleration = row(acceleration, nv);
      s.joint_load = row(load, 6 * nj);
      s.drive_torque = row(torque, nv);
      s.external = row(external, 6 * nj);
      s.kinetic_energy = row(kinetic, 1);
      s.potential_energy = row(potential, 1);
      if (!simulation.advance(times.data()[done], s)) break;
      const SimulationStatistics st = simulation.statistics();
      statistics.push_back({double(st.steps), double(st.evaluations), double(st.iterations),
                            st.last_step, double(st.last_order)});
    }
  } catch (nb::python_error& error) {  // from a function of the user's
    if (!error.matches(PyExc_KeyboardInterrupt)) throw;
    interrupted = true;
  }
  interrupted |= interrupt.was_keyboard();
  const nb::slice head(nb::int_(0), nb::int_(done), nb::int_(1));
  nb::dict out;
  const auto put = [&](const char* name, const std::unique_ptr<NewArray>& a) {
    if (a) out[name] = nb::cast(a->array)[head];
  };
  const std::vector<double> reached(times.data(), times.data() + done);
  out["time"] = to_numpy(reached);
  put("position", position);
  put("velocity", velocity);
  put("acceleration", acceleration);
  put("joint_load", load);
  put("drive_torque", torque);
  put("external_wrench", external);
  put("kinetic_energy", kinetic);
  put("potential_energy", potential);
  const char* names[5] = {"steps", "evaluations", "iterations", "step_size", "order"};
  for (int k = 0; k < 5; ++k) {
    std::vector<double> values;
    for (const auto& row : statistics) values.push_back(row[k]);
    nb::object array = nb::cast(to_numpy(values));
    out[names[k]] = k == 3 ? array : nb::object(array.attr("astype")("int64"));
  }
  const Ending& stop = simulation.ending();
  out["outcome"] = std::string(to_string(interrupted ? Outcome::interrupted : stop.outcome));
  out["stop_time"] = stop.ok() ? (done ? times.data()[done - 1] : 0.0) : stop.time;
  out["stop_joint"] =
      stop.joint >= 0 ? nb::object(nb::cast(model->joints[stop.joint].name)) : nb::none();
  out["message"] = stop.text;
  return out;
}

nb::dict trace_columns(const std::vector<EvaluationTrace>& trace) {
  std::vector<double> time, seconds, iterations, accepted;
  for (const EvaluationTrace& row : trace) {
    time.push_back(row.time);
    seconds.push_back(row.seconds);
    iterations.push_back(row.iterations);
    accepted.push_back(row.accepted);
  }
  nb::dict out;
  out["time"] = to_numpy(time);
  out["seconds"] = to_numpy(seconds);
  out["iterations"] = nb::cast(to_numpy(iterations)).attr("astype")("int64");
  out["accepted"] = nb::cast(to_numpy(accepted)).attr("astype")("bool");
  return out;
}

SimulationOptions options_of(const std::string& method, const std::string& solver,
                             const std::string& guess, const std::string& stop,
                             nb::handle solver_tolerance, nb::handle max_iterations,
                             nb::handle solver_options, const std::string& state,
                             const std::string& integrator, double tolerance,
                             nb::handle step_tolerance, nb::handle step, nb::handle max_step,
                             int threads) {
  SimulationOptions o;
  o.dynamics.threads = checked_threads(threads);
  if (!(tolerance > 0) || !std::isfinite(tolerance))
    throw InputError("tolerance must be a positive number; 1e-6 is usual");
  const double allowed_a_step =
      step_tolerance.is_none() ? step_share * tolerance : nb::cast<double>(step_tolerance);
  if (!(allowed_a_step > 0) || !std::isfinite(allowed_a_step))
    throw InputError("step_tolerance must be a positive number; a tenth of tolerance is usual");
  o.dynamics.method = method;
  o.dynamics.solver = solver;
  o.dynamics.initial_guess = guess;
  o.dynamics.solver_options.stop = stop_rule_from_name(stop);
  // The constraint forces perturb the accelerations by as much: a tenth of the step's error
  // [sharf1993].
  o.dynamics.solver_options.tolerance =
      solver_tolerance.is_none() ? allowed_a_step / 10 : nb::cast<double>(solver_tolerance);
  if (!max_iterations.is_none())
    o.dynamics.solver_options.max_iterations = nb::cast<int>(max_iterations);
  read_solver_options(solver_options, o.dynamics);
  o.follow_error_test = solver_tolerance.is_none() && !gives_tolerance(solver_options);
  o.state = state_choice_from_name(state);
  o.integrator = find_integrator(integrator).kind;
  o.integration.tolerance = allowed_a_step;
  if (!step.is_none()) o.integration.step = nb::cast<double>(step);
  if (!max_step.is_none()) o.integration.max_step = nb::cast<double>(max_step);
  return o;
}

}  // namespace

void bind_simulation(nb::module_& m) {
  nb::class_<PySimulation>(m, "Simulation", "The compiled time loop behind linkwise.simulate.")
      .def(
          "__init__",
          [](PySimulation* self, const PyModel& model, const std::string& method,
             const std::string& solver, const std::string& guess, const std::string& stop,
             nb::object solver_tolerance, nb::object max_iterations, nb::object solver_options,
             const std::string& state, const std::string& integrator, double tolerance,
             nb::object step_tolerance, nb::object step, nb::object max_step, nb::object threads) {
            new (self) PySimulation(
                model, options_of(method, solver, guess, stop, solver_tolerance, max_iterations,
                                  solver_options, state, integrator, tolerance, step_tolerance,
                                  step, max_step, threads_of(threads, 1 << 20)));
          },
          "model"_a, nb::kw_only(), "method"_a = "auto", "solver"_a = "auto",
          "initial_guess"_a = "cubic", "stop"_a = "energy_norm", "solver_tolerance"_a = nb::none(),
          "max_iterations"_a = nb::none(), "solver_options"_a = nb::none(),
          "state"_a = "joint_rates", "integrator"_a = "adams", "tolerance"_a = 1e-6,
          "step_tolerance"_a = nb::none(), "step"_a = nb::none(), "max_step"_a = nb::none(),
          "threads"_a = nb::none())
      .def("drive_torque", &PySimulation::torque, "joint"_a, "values"_a)
      .def("drive_torque_table", &PySimulation::torque_table, "joint"_a, "times"_a, "values"_a,
           "interpolation"_a = "linear")
      .def("drive_torque_callable", &PySimulation::torque_callable, "joint"_a, "fn"_a)
      .def("drive_motion_table", &PySimulation::motion_table, "joint"_a, "times"_a, "values"_a,
           "interpolation"_a = "cubic")
      .def("drive_motion_callable", &PySimulation::motion_callable, "joint"_a, "fn"_a)
      .def("drive_pd", &PySimulation::pd, "joint"_a, "kp"_a, "kd"_a, "target"_a)
      .def("drive_pd_table", &PySimulation::pd_table, "joint"_a, "kp"_a, "kd"_a, "times"_a,
           "values"_a, "interpolation"_a = "linear")
      .def(
          "drive_locked",
          [](PySimulation& s, const std::string& j) { s.set_kind(j, DriveKind::locked); },
          "joint"_a)
      .def(
          "drive_free",
          [](PySimulation& s, const std::string& j) { s.set_kind(j, DriveKind::free); }, "joint"_a)
      .def(
          "wrench",
          [](PySimulation& s, const std::string& body, nb::object value, const std::string& frame) {
            Wrench w = s.wrench_on(body, frame);
            w.value = constants(value, "wrench", 6);
            s.simulation.add_wrench(std::move(w));
          },
          "body"_a, "value"_a, "frame"_a = "world")
      .def(
          "wrench_table",
          [](PySimulation& s, const std::string& body, nb::object times, nb::object values,
             const std::string& interpolation, const std::string& frame) {
            Wrench w = s.wrench_on(body, frame);
            w.table = make_table(times, values, interpolation, 6);
            s.simulation.add_wrench(std::move(w));
          },
          "body"_a, "times"_a, "values"_a, "interpolation"_a = "linear", "frame"_a = "world")
      .def(
          "wrench_callable",
          [](PySimulation& s, const std::string& body, nb::callable fn, const std::string& frame) {
            Wrench w = s.wrench_on(body, frame);
            w.callable = [fn, body](double t, double* out) {
              const nb::gil_scoped_acquire acquire;
              store(fn(t), "wrench returned for body '" + body + "'", out, 6);
            };
            s.simulation.add_wrench(std::move(w));
          },
          "body"_a, "fn"_a, "frame"_a = "world")
      .def("start", &PySimulation::start, "t0"_a, "q0"_a, "v0"_a)
      .def("advance", &advance, "times"_a, "quantities"_a = nb::none())
      .def(
          "keep_trace", [](PySimulation& s, bool wanted) { s.simulation.keep_trace(wanted); },
          "wanted"_a = true,
          "From the next start on, record every evaluation that the integrator asks for.")
      .def(
          "trace", [](const PySimulation& s) { return trace_columns(s.simulation.trace()); },
          "The evaluations so far, one array entry each: simulated time, seconds spent, "
          "iterations, "
          "and whether the step that it ended was accepted.")
      .def_prop_ro(
          "velocity_drift", [](const PySimulation& s) { return s.simulation.velocity_drift(); },
          "State body_velocities: how far joints come apart at the last sample, m/s or rad/s.")
      .def_prop_ro(
          "step_tolerance",
          [](const PySimulation& s) { return s.simulation.options().integration.tolerance; })
      .def_prop_ro("method", [](const PySimulation& s) { return s.simulation.choice().method; })
      .def_prop_ro("solver", [](const PySimulation& s) { return s.simulation.choice().solver; })
      .def_prop_ro("reason", [](const PySimulation& s) { return s.simulation.choice().reason; });
}

}  // namespace linkwise::bindings
