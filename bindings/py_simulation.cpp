#include "py_simulation.hpp"

#include <algorithm>

#include <nanobind/stl/string.h>

#include "frame.hpp"

namespace linkwise::bindings {
namespace {

void check_table(const ArrayIn& t, const ArrayIn& y, size_t columns) {
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
}

/// The parabola through three samples, which is the not-a-knot spline of so few. SciPy solves for
/// it and warns where the times are very uneven.
void add_parabola(const double* t, const double* y, size_t columns, std::vector<double>& to) {
  const double first = t[1] - t[0], second = t[2] - t[1];
  std::vector<double> slopes[2], halves;
  for (size_t c = 0; c < columns; ++c) {
    const double before = (y[columns + c] - y[c]) / first;
    const double after = (y[2 * columns + c] - y[columns + c]) / second;
    halves.push_back((after - before) / (first + second));
    slopes[0].push_back(before - halves[c] * first);
    slopes[1].push_back(before + halves[c] * first);
  }
  for (size_t i = 0; i < 2; ++i) {
    to.insert(to.end(), columns, 0.0);
    to.insert(to.end(), halves.begin(), halves.end());
    to.insert(to.end(), slopes[i].begin(), slopes[i].end());
    to.insert(to.end(), y + i * columns, y + (i + 1) * columns);
  }
}

/// Values over time as piecewise polynomials; cubic ones are SciPy's not-a-knot splines.
Table make_table(nb::handle times, nb::handle values, const std::string& interpolation,
                 size_t columns) {
  const ArrayIn t = as_array(times, "times");
  const ArrayIn y = as_array(values, "values");
  check_table(t, y, columns);
  const size_t n = t.shape(0);
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
  if (n == 3) {
    add_parabola(t.data(), y.data(), columns, table.coefficients);
    return table;
  }
  const nb::object rows = numpy("reshape")(y.object(), nb::make_tuple(n, columns));
  const nb::object spline = python_function("scipy.interpolate", "CubicSpline")(t.object(), rows);
  const ArrayIn c =
      as_array(numpy("transpose")(spline.attr("c"), nb::make_tuple(1, 0, 2)), "coefficients");
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

/// breakpoints: times, or None; samples: (times, values of as many columns), or None.
FunctionCourse course_of(nb::handle breakpoints, nb::handle samples, size_t columns) {
  FunctionCourse course;
  if (!breakpoints.is_none()) {
    const ArrayIn times = as_array(breakpoints, "breakpoints");
    course.breakpoints.assign(times.data(), times.data() + times.size());
    if (!std::is_sorted(course.breakpoints.begin(), course.breakpoints.end()))
      throw InputError("breakpoints are not increasing; sort them");
  }
  if (!samples.is_none()) course.sampled = make_table(samples[0], samples[1], "linear", columns);
  return course;
}

/// Without its value yet.
Wrench wrench_at(const Model& model, const Frame& at, const std::string& frame) {
  if (frame != "world" && frame != "body")
    throw InputError("frame '" + frame + "' is unknown; known: world, body");
  const FramePlacement place = place_frame(model, at);
  if (place.joint < 0)
    throw InputError("link '" + at.link + "'" + model.where() +
                     " is fixed to the ground, where a wrench moves nothing; give a frame on a "
                     "moving link");
  Wrench w;
  w.joint = place.joint;
  w.world = frame == "world";
  w.placement = place.placement;
  return w;
}

Drive gains(const std::string& name, double kp, double kd) {
  if (!(kp >= 0) || !(kd >= 0) || !std::isfinite(kp + kd))
    throw InputError("joint '" + name + "': gains kp and kd must be finite and >= 0");
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
  return model->joints[model->joint_index(joint)].nv;
}

void PySimulation::set(const std::string& joint, Drive drive) {
  simulation.set_drive(model->joint_index(joint), std::move(drive));
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
  const JointInfo& info = model->joints[model->joint_index(name)];
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
  if (interpolation == "linear")
    throw InputError("joint '" + name +
                     "': the velocity of a linear table jumps at every row; use cubic");
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
  Drive d = gains(name, kp, kd);
  d.value = constants(target, ("target of joint '" + name + "'").c_str(), width(name));
  set(name, std::move(d));
}

void PySimulation::pd_table(const std::string& name, double kp, double kd, nb::handle times,
                            nb::handle values, const std::string& interpolation) {
  Drive d = gains(name, kp, kd);
  d.table = make_table(times, values, interpolation, width(name));
  set(name, std::move(d));
}

void PySimulation::locked(const std::string& joint) {
  Drive d;
  d.kind = DriveKind::locked;
  set(joint, std::move(d));
}

void PySimulation::free(const std::string& joint) { set(joint, {}); }

void PySimulation::wrench(nb::handle at, nb::handle value, const std::string& frame) {
  Wrench w = wrench_at(*model, as_frame(at), frame);
  w.value = constants(value, "wrench", 6);
  simulation.add_wrench(std::move(w));
}

void PySimulation::wrench_table(nb::handle at, nb::handle times, nb::handle values,
                                const std::string& interpolation, const std::string& frame) {
  Wrench w = wrench_at(*model, as_frame(at), frame);
  w.table = make_table(times, values, interpolation, 6);
  simulation.add_wrench(std::move(w));
}

void PySimulation::wrench_callable(nb::handle at, nb::callable fn, const std::string& frame,
                                   nb::handle breakpoints, nb::handle samples) {
  const Frame where = as_frame(at);
  Wrench w = wrench_at(*model, where, frame);
  w.course = course_of(breakpoints, samples, 6);
  w.callable = [fn = keep(std::move(fn)), link = where.link](double t, double* out) {
    const GilHeld held;
    store((*fn)(t), "wrench returned for link '" + link + "'", out, 6);
  };
  simulation.add_wrench(std::move(w));
}

void PySimulation::keep_extremes(nb::handle directions) {
  const size_t n = static_cast<size_t>(model->n_joints());
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

void PySimulation::start(double t0, nb::handle q, nb::handle v, std::vector<std::string> hold) {
  const Argument q0("q0", {static_cast<size_t>(model->nq())}, q),
      v0("v0", {static_cast<size_t>(model->nv())}, v);
  if (!q0.given || q0.array.ndim() != 1)
    throw InputError("q0 must have shape (" + std::to_string(model->nq()) + ",)");
  if (!v0.given || v0.array.ndim() != 1)
    throw InputError("v0 must have shape (" + std::to_string(model->nv()) + ",)");
  Start start{q0.data, v0.data};
  start.hold = std::move(hold);
  simulation.start(t0, start);
}

}  // namespace linkwise::bindings
