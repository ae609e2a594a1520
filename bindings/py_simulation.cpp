#include "py_simulation.hpp"

#include <algorithm>

#include <nanobind/stl/string.h>

#include "frame.hpp"

namespace linkwise::bindings {
namespace {

/// Values over time as piecewise polynomials; cubic ones are SciPy's not-a-knot splines, but
/// for three rows, where SciPy solves for the parabola and warns if the times are very uneven.
Table make_table(nb::handle times, nb::handle values, const std::string& interpolation,
                 size_t columns) {
  const ArrayIn t = as_array(times, "times");
  const ArrayIn y = as_array(values, "values");
  const size_t n = t.size();
  if (t.ndim() != 1) throw InputError("times has shape " + shape_text(shape_of(t)) + "; give (n,)");
  const bool flat = y.ndim() == 1 && columns == 1;
  if (!flat && (y.ndim() != 2 || y.shape(1) != columns))
    throw InputError("values has shape " + shape_text(shape_of(y)) + " but shape (" +
                     std::to_string(n) + ", " + std::to_string(columns) + ") is expected");
  if (y.shape(0) != n)
    throw InputError("values has " + std::to_string(y.shape(0)) + " rows but there are " +
                     std::to_string(n) + " times");
  check_rows({t.data(), n}, {y.data(), y.size()});
  if (interpolation == "linear") return linear_table({t.data(), n}, {y.data(), y.size()});
  if (interpolation != "cubic")
    throw InputError("interpolation '" + interpolation + "' is unknown; known: linear, cubic");
  if (n == 3) return parabola_table({t.data(), n}, {y.data(), y.size()});
  const nb::object rows = numpy("reshape")(y.object(), nb::make_tuple(n, columns));
  const nb::object spline = python_function("scipy.interpolate", "CubicSpline")(t.object(), rows);
  const ArrayIn c =
      as_array(numpy("transpose")(spline.attr("c"), nb::make_tuple(1, 0, 2)), "coefficients");
  return {{t.data(), t.data() + n}, 3, static_cast<int>(columns), {c.data(), c.data() + c.size()}};
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

/// breakpoints: times, or None; samples: (times, values of as many columns), or None.
FunctionCourse course_of(nb::handle breakpoints, nb::handle samples, size_t columns) {
  FunctionCourse course;
  if (!breakpoints.is_none()) {
    const ArrayIn times = as_array(breakpoints, "breakpoints");
    course.breakpoints.assign(times.data(), times.data() + times.size());
  }
  if (!samples.is_none()) course.sampled = make_table(samples[0], samples[1], "linear", columns);
  return course;
}

Drive pd_drive(double kp, double kd) {
  Drive d;
  d.kind = DriveKind::pd;
  d.kp = kp;
  d.kd = kd;
  return d;
}

}  // namespace

std::shared_ptr<PythonFunction> PySimulation::keep(nb::callable fn) {
  auto kept = std::make_shared<PythonFunction>(std::move(fn));
  functions_.push_back(kept);
  return kept;
}

int PySimulation::traverse(visitproc visit, void* arg) const {
  for (const std::weak_ptr<PythonFunction>& function : functions_)
    if (const auto held = function.lock()) Py_VISIT(held->ptr());
  return 0;
}

void PySimulation::clear() {
  for (const std::weak_ptr<PythonFunction>& function : functions_)
    if (const auto held = function.lock()) held->forget();
}

size_t PySimulation::width(const std::string& joint) const {
  return model->joint_at(model->load_index(joint)).nv;
}

void PySimulation::set(const std::string& joint, Drive drive) {
  simulation.set_drive(model->load_index(joint), std::move(drive));
}

void PySimulation::torque(const std::string& name, nb::handle values) {
  Drive d;
  d.kind = DriveKind::torque;
  d.value = constants(values, ("torque of joint '" + name + "'").c_str(), width(name));
  set(name, std::move(d));
}

void PySimulation::torque_table(const std::string& name, nb::handle times, nb::handle values,
                                const std::string& interpolation, bool smooth) {
  Drive d;
  d.kind = DriveKind::torque_table;
  d.smooth = smooth;
  d.table = make_table(times, values, interpolation, width(name));
  set(name, std::move(d));
}

void PySimulation::torque_callable(const std::string& name, nb::callable fn, nb::handle breakpoints,
                                   nb::handle samples) {
  const JointInfo& info = model->joint_at(model->load_index(name));
  Drive d;
  d.kind = DriveKind::torque_callable;
  d.course = course_of(breakpoints, samples, width(name));
  d.callable = [fn = keep(std::move(fn)), name, nq = info.nq, nv = info.nv](
                   double t, const double* q, const double* v, double* out) {
    const GilHeld held;
    store((*fn)(t, copy_of(q, nq), copy_of(v, nv)), "torque returned for joint '" + name + "'", out,
          nv);
  };
  set(name, std::move(d));
}

void PySimulation::motion_table(const std::string& name, nb::handle times, nb::handle values,
                                const std::string& interpolation) {
  Drive d;
  d.kind = DriveKind::motion;
  d.table = make_table(times, values, interpolation, width(name));
  set(name, std::move(d));
}

void PySimulation::motion_callable(const std::string& name, nb::callable fn, nb::handle breakpoints,
                                   nb::handle samples) {
  Drive d;
  d.kind = DriveKind::motion;
  d.course = course_of(breakpoints, samples, width(name));
  d.motion = [fn = keep(std::move(fn)), name, nv = width(name)](double t, double* q, double* v,
                                                                double* a) {
    const GilHeld held;
    const nb::object returned = (*fn)(t);
    if (!nb::isinstance<nb::sequence>(returned) || nb::len(returned) != 3)
      throw InputError("motion returned for joint '" + name +
                       "' is not three values; return position, rate and acceleration");
    double* out[3] = {q, v, a};
    const char* what[3] = {"position", "rate", "acceleration"};
    for (int k = 0; k < 3; ++k)
      store(returned[k], std::string(what[k]) + " returned for joint '" + name + "'", out[k], nv);
  };
  set(name, std::move(d));
}

void PySimulation::pd(const std::string& name, double kp, double kd, nb::handle target) {
  Drive d = pd_drive(kp, kd);
  d.value = constants(target, ("target of joint '" + name + "'").c_str(), width(name));
  set(name, std::move(d));
}

void PySimulation::pd_table(const std::string& name, double kp, double kd, nb::handle times,
                            nb::handle values, const std::string& interpolation) {
  Drive d = pd_drive(kp, kd);
  d.table = make_table(times, values, interpolation, width(name));
  set(name, std::move(d));
}

void PySimulation::locked(const std::string& joint) {
  Drive d;
  d.kind = DriveKind::locked;
  set(joint, std::move(d));
}

void PySimulation::free(const std::string& joint) { set(joint, {}); }

void PySimulation::wrench(nb::handle at, nb::handle value, const std::string& axes) {
  Wrench w = wrench_at(*model, as_frame(at), axes);
  w.value = constants(value, "wrench", 6);
  simulation.add_wrench(std::move(w));
}

void PySimulation::wrench_table(nb::handle at, nb::handle times, nb::handle values,
                                const std::string& interpolation, const std::string& axes) {
  Wrench w = wrench_at(*model, as_frame(at), axes);
  w.table = make_table(times, values, interpolation, 6);
  simulation.add_wrench(std::move(w));
}

void PySimulation::wrench_callable(nb::handle at, nb::callable fn, const std::string& axes,
                                   nb::handle breakpoints, nb::handle samples) {
  const Frame where = as_frame(at);
  Wrench w = wrench_at(*model, where, axes);
  w.course = course_of(breakpoints, samples, 6);
  w.callable = [fn = keep(std::move(fn)), link = where.link](double t, double* out) {
    const GilHeld held;
    store((*fn)(t), "wrench returned for link '" + link + "'", out, 6);
  };
  simulation.add_wrench(std::move(w));
}

void PySimulation::keep_extremes(nb::handle directions) {
  const size_t n = static_cast<size_t>(model->n_loads());
  const ArrayIn rows = as_array(directions, "directions");
  if (rows.ndim() != 2 || rows.shape(0) != n || rows.shape(1) != 3)
    throw InputError("directions has shape " + shape_text(shape_of(rows)) + "; give shape (" +
                     std::to_string(n) + ", 3)");
  simulation.keep_extremes({rows.data(), rows.data() + rows.size()});
}

nb::object PySimulation::extremes() {
  if (!simulation.keeps_extremes())
    throw InputError("no extremes are kept; call keep_extremes before start");
  std::vector<double> found;
  {
    const GilReleased released;  // functions of the caller's may be asked
    found = simulation.extremes();
  }
  return to_numpy(found);
}

void PySimulation::start(
    double t0, nb::handle q, nb::handle v, std::vector<std::string> hold,
    const std::vector<std::pair<std::string, std::vector<double>>>& loop_rates) {
  const Argument q0("q0", {static_cast<size_t>(model->nq())}, q),
      v0("v0", {static_cast<size_t>(model->nv())}, v);
  if (!q0.given || q0.array.ndim() != 1)
    throw InputError("q0 must have shape (" + std::to_string(model->nq()) + ",)");
  if (!v0.given || v0.array.ndim() != 1)
    throw InputError("v0 must have shape (" + std::to_string(model->nv()) + ",)");
  Start start{q0.data, v0.data};
  start.hold = std::move(hold);
  for (const auto& [joint, rates] : loop_rates) start.loop_rates.push_back({joint, rates});
  simulation.start(t0, start);
}

}  // namespace linkwise::bindings
