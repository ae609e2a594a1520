#include <set>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "linkwise/exec/thread_pool.hpp"
#include "linkwise/simulate/simulation.hpp"
#include "linkwise/solve/registry.hpp"
#include "py_model.hpp"
#include "solver_options.hpp"

namespace linkwise::bindings {
namespace {

/// Values over time as piecewise polynomials; cubic ones are SciPy's not-a-knot splines.
Table make_table(nb::handle times, nb::handle values, const std::string& interpolation,
                 size_t columns) {
  const ArrayIn t = as_array(times, "times");
  const ArrayIn y = as_array(values, "values");
  if (t.ndim() != 1 || t.shape(0) < 2)
    throw InputError("times has shape " + shape_text(shape_of(t)) +
                     "; a table needs at least two times");
  const size_t n = t.shape(0);
  const bool flat = y.ndim() == 1 && columns == 1;
  if (!flat && (y.ndim() != 2 || y.shape(1) != columns))
    throw InputError("values has shape " + shape_text(shape_of(y)) + " but shape (" +
                     std::to_string(n) + ", " + std::to_string(columns) + ") is expected");
  if (y.shape(0) != n)
    throw InputError("values has " + std::to_string(y.shape(0)) + " rows but there are " +
                     std::to_string(n) + " times");
  for (size_t i = 0; i < n * columns; ++i)
    if (!std::isfinite(y.data()[i]))
      throw InputError("values is not finite in row " + std::to_string(i / columns));
  for (size_t i = 0; i < n; ++i)
    if (!std::isfinite(t.data()[i]) || (i > 0 && !(t.data()[i] > t.data()[i - 1])))
      throw InputError("times is not increasing at row " + std::to_string(i) +
                       "; sort the table by time and remove repeated times");
  Table table;
  table.breaks.assign(t.data(), t.data() + n);
  table.columns = static_cast<int>(columns);
  if (interpolation == "linear") {
    table.degree = 1;
    for (size_t i = 0; i + 1 < n; ++i) {
      for (size_t c = 0; c < columns; ++c)
        table.coefficients.push_back((y.data()[(i + 1) * columns + c] - y.data()[i * columns + c]) /
                                     (t.data()[i + 1] - t.data()[i]));
      for (size_t c = 0; c < columns; ++c) table.coefficients.push_back(y.data()[i * columns + c]);
    }
    return table;
  }
  if (interpolation != "cubic")
    throw InputError("interpolation '" + interpolation + "' is unknown; known: linear, cubic");
  table.degree = 3;
  const nb::object numpy = nb::module_::import_("numpy");
  const nb::object rows = numpy.attr("reshape")(nb::cast(y), nb::make_tuple(n, columns));
  const nb::object spline =
      nb::module_::import_("scipy.interpolate").attr("CubicSpline")(nb::cast(t), rows);
  const ArrayIn c = as_array(numpy.attr("ascontiguousarray")(numpy.attr("transpose")(
                                 spline.attr("c"), nb::make_tuple(1, 0, 2))),
                             "coefficients");
  table.coefficients.assign(c.data(), c.data() + c.size());
  return table;
}

std::vector<double> constants(nb::handle value, const char* name, size_t n) {
  const ArrayIn a = as_array(value, name);
  if (a.size() != n && a.size() != 1)
    throw InputError(std::string(name) + " has shape " + shape_text(shape_of(a)) + " but shape (" +
                     std::to_string(n) + ",) is expected");
  std::vector<double> out(n);
  for (size_t i = 0; i < n; ++i) {
    out[i] = a.data()[a.size() == 1 ? 0 : i];
    if (!std::isfinite(out[i]))
      throw InputError(std::string(name) + " is not finite; give finite numbers");
  }
  return out;
}

nb::object copy_of(const double* x, int n) { return nb::cast(to_numpy({x, x + n})); }

void store(nb::handle result, const std::string& who, double* out, size_t n) {
  const std::vector<double> values = constants(result, who.c_str(), n);
  std::copy(values.begin(), values.end(), out);
}

class PySimulation {
 public:
  PySimulation(const PyModel& owner, SimulationOptions options)
      : model(owner.model), simulation(owner.model, std::move(options)) {}

  std::shared_ptr<const Model> model;
  Simulation simulation;

  int joint(const std::string& name) const { return model->joint_index(name); }
  size_t width(int j) const { return model->joints[j].nv; }

  void torque(const std::string& name, nb::handle values) {
    const int j = joint(name);
    Drive d;
    d.kind = DriveKind::torque;
    d.value = constants(values, ("torque of joint '" + name + "'").c_str(), width(j));
    simulation.set_drive(j, std::move(d));
  }
  void torque_table(const std::string& name, nb::handle times, nb::handle values,
                    const std::string& interpolation) {
    const int j = joint(name);
    Drive d;
    d.kind = DriveKind::torque_table;
    d.table = make_table(times, values, interpolation, width(j));
    simulation.set_drive(j, std::move(d));
  }
  void torque_callable(const std::string& name, nb::callable fn) {
    const int j = joint(name);
    const JointInfo& info = model->joints[j];
    Drive d;
    d.kind = DriveKind::torque_callable;
    d.callable = [fn, name, nq = info.nq, nv = info.nv](double t, const double* q, const double* v,
                                                        double* out) {
      const nb::gil_scoped_acquire acquire;
      store(fn(t, copy_of(q, nq), copy_of(v, nv)), "torque returned for joint '" + name + "'", out,
            nv);
    };
    simulation.set_drive(j, std::move(d));
  }
  void motion_table(const std::string& name, nb::handle times, nb::handle values,
                    const std::string& interpolation) {
    const int j = joint(name);
    if (interpolation == "linear")
      throw InputError("joint '" + name +
                       "': the velocity of a linear table jumps at every row; use cubic");
    Drive d;
    d.kind = DriveKind::motion;
    d.table = make_table(times, values, interpolation, width(j));
    simulation.set_drive(j, std::move(d));
  }
  void motion_callable(const std::string& name, nb::callable fn) {
    const int j = joint(name);
    Drive d;
    d.kind = DriveKind::motion;
    d.motion = [fn, name, nv = width(j)](double t, double* q, double* v, double* a) {
      const nb::gil_scoped_acquire acquire;
      const nb::object returned = fn(t);
      if (!nb::isinstance<nb::sequence>(returned) || nb::len(returned) != 3)
        throw InputError("motion returned for joint '" + name +
                         "' is not three values; return position, rate and acceleration");
      double* out[3] = {q, v, a};
      const char* what[3] = {"position", "rate", "acceleration"};
      for (int k = 0; k < 3; ++k)
        store(returned[k], std::string(what[k]) + " returned for joint '" + name + "'", out[k], nv);
    };
    simulation.set_drive(j, std::move(d));
  }
  void pd(const std::string& name, double kp, double kd, nb::handle target) {
    const int j = joint(name);
    Drive d = gains(name, kp, kd);
    d.value = constants(target, ("target of joint '" + name + "'").c_str(), width(j));
    simulation.set_drive(j, std::move(d));
  }
  void pd_table(const std::string& name, double kp, double kd, nb::handle times, nb::handle values,
                const std::string& interpolation) {
    const int j = joint(name);
    Drive d = gains(name, kp, kd);
    d.table = make_table(times, values, interpolation, width(j));
    simulation.set_drive(j, std::move(d));
  }
  Drive gains(const std::string& name, double kp, double kd) const {
    if (!(kp >= 0) || !(kd >= 0) || !std::isfinite(kp + kd))
      throw InputError("joint '" + name + "': gains kp and kd must be finite and >= 0");
    Drive d;
    d.kind = DriveKind::pd;
    d.kp = kp;
    d.kd = kd;
    return d;
  }
  void set_kind(const std::string& name, DriveKind kind) {
    Drive d;
    d.kind = kind;
    simulation.set_drive(joint(name), std::move(d));
  }

  Wrench wrench_on(const std::string& body, const std::string& frame) const {
    if (frame != "world" && frame != "body")
      throw InputError("frame '" + frame + "' is unknown; known: world, body");
    const LinkInfo& link = model->links[model->link_index(body)];
    if (link.joint < 0 || model->links[model->joints[link.joint].link].name != body)
      throw InputError("link '" + body + "'" + model->where() +
                       " is welded to another; apply the wrench to '" +
                       (link.joint < 0 ? std::string("a moving body")
                                       : model->links[model->joints[link.joint].link].name) +
                       "'");
    Wrench w;
    w.joint = link.joint;
    w.world = frame == "world";
    return w;
  }

  void start(double t0, nb::handle q, nb::handle v) {
    const Argument q0("q0", {static_cast<size_t>(model->nq())}, q),
        v0("v0", {static_cast<size_t>(model->nv())}, v);
    if (!q0.given || q0.array.ndim() != 1)
      throw InputError("q0 must have shape (" + std::to_string(model->nq()) + ",)");
    if (!v0.given || v0.array.ndim() != 1)
      throw InputError("v0 must have shape (" + std::to_string(model->nv()) + ",)");
    simulation.start(t0, q0.data, v0.data);
  }

  nb::dict advance(nb::handle times, const nb::object& quantities);
};

nb::dict PySimulation::advance(nb::handle times_in, const nb::object& quantities) {
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
  {
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
  }
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
  const Stop& stop = simulation.stop();
  out["outcome"] = stop.outcome;
  out["stop_time"] = stop.ok() ? (done ? times.data()[done - 1] : 0.0) : stop.time;
  out["stop_joint"] =
      stop.joint >= 0 ? nb::object(nb::cast(model->joints[stop.joint].name)) : nb::none();
  out["message"] = stop.message;
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
                             const std::string& integrator, double tolerance, nb::handle step,
                             nb::handle max_step, int threads) {
  SimulationOptions o;
  o.dynamics.threads = checked_threads(threads);
  if (!(tolerance > 0) || !std::isfinite(tolerance))
    throw InputError("tolerance must be a positive number; 1e-6 is usual");
  o.dynamics.method = method;
  o.dynamics.solver = solver;
  o.dynamics.initial_guess = guess;
  o.dynamics.solver_options.stop = stop_rule_from_name(stop);
  // The constraint forces perturb the accelerations by as much: a tenth of the step's error
  // [sharf1993].
  o.dynamics.solver_options.tolerance =
      solver_tolerance.is_none() ? tolerance / 10 : nb::cast<double>(solver_tolerance);
  if (!max_iterations.is_none())
    o.dynamics.solver_options.max_iterations = nb::cast<int>(max_iterations);
  read_solver_options(solver_options, o.dynamics);
  o.state = state_choice_from_name(state);
  o.integrator = find_integrator(integrator).kind;
  o.integration.tolerance = tolerance;
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
             nb::object step, nb::object max_step, nb::object threads) {
            new (self) PySimulation(
                model, options_of(method, solver, guess, stop, solver_tolerance, max_iterations,
                                  solver_options, state, integrator, tolerance, step, max_step,
                                  threads_of(threads, 1 << 20)));
          },
          "model"_a, nb::kw_only(), "method"_a = "auto", "solver"_a = "auto",
          "initial_guess"_a = "cubic", "stop"_a = "energy_norm", "solver_tolerance"_a = nb::none(),
          "max_iterations"_a = nb::none(), "solver_options"_a = nb::none(),
          "state"_a = "joint_rates", "integrator"_a = "adams", "tolerance"_a = 1e-6,
          "step"_a = nb::none(), "max_step"_a = nb::none(), "threads"_a = nb::none())
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
      .def("advance", &PySimulation::advance, "times"_a, "quantities"_a = nb::none())
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
      .def_prop_ro("method", [](const PySimulation& s) { return s.simulation.choice().method; })
      .def_prop_ro("solver", [](const PySimulation& s) { return s.simulation.choice().solver; })
      .def_prop_ro("reason", [](const PySimulation& s) { return s.simulation.choice().reason; });
}

}  // namespace linkwise::bindings
