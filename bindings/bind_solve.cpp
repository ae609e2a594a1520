// Solvers from Python: the tables of guesses, stop rules and options; the system A f = b of a model
// at a state, to look at and to solve; and a dynamics method that keeps its warm starts between
// calls.
#include <chrono>

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "interrupt.hpp"
#include "linkwise/constraint/tree_system.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/forces/passive.hpp"
#include "linkwise/linear/triplets.hpp"
#include "linkwise/simulate/given_motion.hpp"
#include "linkwise/solve/checked_solver.hpp"
#include "linkwise/solve/registry.hpp"
#include "linkwise/solve/spectrum.hpp"
#include "numbers.hpp"
#include "py_model.hpp"
#include "report.hpp"
#include "solver_options.hpp"

namespace linkwise::bindings {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

size_t size(int n) { return static_cast<size_t>(n); }

/// One state or several, with rates and torques that may be left out.
struct StateRows {
  Argument q, v, tau, external;
  size_t count;
  std::vector<double> total_tau, rest;

  StateRows(const Model& m, nb::handle q_, nb::handle v_, nb::handle tau_, nb::handle external_,
            bool passive, size_t most_axes)
      : q("q", {size(m.nq())}, q_),
        v("v", {size(m.nv())}, v_),
        tau("tau", {size(m.nv())}, tau_),
        external("external", {size(m.n_joints()), 6}, external_),
        rest(m.nv()) {
    if (!q.given) throw InputError("q is missing; give " + std::to_string(m.nq()) + " numbers");
    const Shape lead = broadcast_leading({&q, &v, &tau, &external});
    if (lead.size() > most_axes)
      throw InputError("q has shape " + shape_text(shape_of(q.array)) + "; at most " +
                       std::to_string(most_axes + 1) + " axes are expected");
    count = product(lead);
    total_tau.assign(count * m.nv(), 0.0);
    for (size_t i = 0; i < count; ++i) {
      check_quaternions(m, q.data + i * m.nq());
      double* row = total_tau.data() + i * m.nv();
      if (tau.given) std::copy(tau.data + i * m.nv(), tau.data + (i + 1) * m.nv(), row);
      if (passive)
        add_passive_forces(m, q.data + i * m.nq(), v.given ? v.data + i * m.nv() : rest.data(),
                           row);
    }
  }

  SweepInput<double> input(const Model& m, size_t i) const {
    SweepInput<double> in;
    in.q = q.data + i * m.nq();
    in.v = v.given ? v.data + i * m.nv() : rest.data();
    in.tau = total_tau.data() + i * m.nv();
    in.external = external.given ? external.data + i * 6 * m.n_joints() : nullptr;
    return in;
  }
};

/// A f = b of a model at one state. Holds its own copy of the state.
class PyConstraintSystem {
 public:
  PyConstraintSystem(const PyModel& owner, nb::handle q, nb::handle v, nb::handle tau,
                     nb::handle external, bool passive)
      : model_(owner.model), system_(*owner.model) {
    const StateRows rows(*model_, q, v, tau, external, passive, 0);
    const SweepInput<double> in = rows.input(*model_, 0);
    keep(q_, in.q, model_->nq());
    keep(v_, in.v, model_->nv());
    keep(tau_, in.tau, model_->nv());
    add_armature_bias(*model_, v_.data(), -1, tau_.data());
    if (in.external) keep(external_, in.external, 6 * model_->n_joints());
    system_.assemble(input());
    check_result(b().data(), b().size());
    if (!A().all_finite()) refuse_result();
  }

  const BlockTree& A() const { return system_.A(); }
  const Model& model() const { return *model_; }

  const std::vector<double>& b() const { return system_.b(); }
  nb::object right_hand_side() const { return read_only(to_numpy(b())); }

  std::vector<double> unknowns(nb::handle value, const char* name) const {
    const Argument given(name, {size(A().size())}, value);
    if (!given.given || given.array.ndim() != 1)
      throw InputError(std::string(name) + " must have shape (" + std::to_string(A().size()) +
                       ",)");
    return {given.data, given.data + A().size()};
  }

  nb::object multiply(nb::handle x) const {
    std::vector<double> y(A().size());
    A().multiply(unknowns(x, "f"), y);
    check_result(y.data(), y.size());
    return to_numpy(y);
  }

  double energy_norm(nb::handle x) const {
    const std::vector<double> f = unknowns(x, "f");
    std::vector<double> y(f.size());
    A().multiply(f, y);
    double sum = 0;
    for (size_t i = 0; i < f.size(); ++i) sum += f[i] * y[i];
    check_result(&sum, 1);
    return std::sqrt(std::max(0.0, sum));
  }

  nb::object dense() const {
    const size_t n = A().size();
    NewArray out({n, n}, {});
    std::vector<double> unit(n);
    for (size_t i = 0; i < n; ++i) {
      unit[i] = 1;
      A().multiply(unit, {out.data + i * n, n});  // symmetric: rows are columns
      unit[i] = 0;
    }
    return out.array;
  }

  nb::object sparse() const;

  nb::tuple solve(const std::string& solver, nb::handle guess, double tolerance,
                  const std::string& stop, int max_iterations, nb::handle solver_options) {
    DynamicsOptions options;
    options.solver_options.tolerance = tolerance;
    options.solver_options.stop = stop_rule_from_name(stop);
    options.solver_options.max_iterations = max_iterations;
    set_options(options.solver_options, solver_option_values(solver_options));
    CheckedSolver made(solver, options.solver_options, false);
    std::vector<double> f =
        guess.is_none() ? std::vector<double>(A().size()) : unknowns(guess, "guess");
    Report report;
    {
      const GilReleased released;
      std::vector<double> du(model_->nv());
      report = made.solve(A(), system_.b(), f, [&](bool with_size) {
        TreeSystem::Distance found{.with_size = with_size};
        if (!made.is_direct()) system_.recover(input(), f, du.data(), nullptr, &found);
        return MotionError{found.gap, found.size};
      });
    }
    const Choice choice{"constraint_force", solver, "as asked for"};
    const int body = report.node >= 0 ? system_.body_of_node(report.node) : -1;
    return nb::make_tuple(to_numpy(f), evaluation_report(*model_, choice, {report, body}));
  }

  nb::tuple recover(nb::handle f) {
    NewArray du({size(model_->nv())}, {}), loads({size(model_->n_joints()), 6}, {});
    system_.recover(input(), unknowns(f, "f"), du.data, loads.data);
    check_result(du.data, size(model_->nv()));
    check_result(loads.data, size(6 * model_->n_joints()));
    return nb::make_tuple(du.array, loads.array);
  }

  Spectrum spectrum(int max_steps) const {
    SpectrumOptions options;
    options.max_steps = max_steps;
    return estimate_spectrum(A(), options);
  }

  nb::slice rows(const std::string& joint) const {
    const int node = model_->joints[model_->joint_index(joint)].body;
    return nb::slice(nb::int_(A().offset[node]), nb::int_(A().offset[node + 1]), nb::int_(1));
  }

 private:
  static void keep(std::vector<double>& to, const double* from, int n) {
    to.assign(from, from + n);
  }
  SweepInput<double> input() const {
    SweepInput<double> in;
    in.q = q_.data();
    in.v = v_.data();
    in.tau = tau_.data();
    in.external = external_.empty() ? nullptr : external_.data();
    return in;
  }

  std::shared_ptr<const Model> model_;
  TreeSystem system_;
  std::vector<double> q_, v_, tau_, external_;
};

nb::object PyConstraintSystem::sparse() const {
  const Triplets entries = triplets_of(A());
  const auto index = [](const std::vector<int>& values) {
    return nb::cast(to_numpy({values.begin(), values.end()})).attr("astype")("int64");
  };
  const nb::object coordinates = nb::make_tuple(index(entries.row), index(entries.column));
  const nb::object array =
      nb::module_::import_("scipy.sparse")
          .attr("coo_array")(nb::make_tuple(to_numpy(entries.value), coordinates),
                             "shape"_a = nb::make_tuple(A().size(), A().size()));
  return array.attr("tocsr")();
}

/// A dynamics method with its memory of earlier times, and its clock.
class PyDynamicsMethod {
 public:
  PyDynamicsMethod(const PyModel& owner, DynamicsOptions options)
      : model_(owner.model),
        choice_(choose_dynamics(*owner.model, options)),
        options_(std::move(options)),
        method_(make_dynamics(*owner.model, options_)) {}

  const Choice& choice() const { return choice_; }
  nb::object constraint_force() const {
    const std::span<const double> f = method_->constraint_force();
    return read_only(to_numpy({f.begin(), f.end()}));
  }
  void reset() { method_ = make_dynamics(*model_, options_); }

  nb::tuple evaluate(double t, nb::handle q, nb::handle v, nb::handle tau, nb::handle external,
                     bool passive, bool accept) {
    const Model& m = *model_;
    const StateRows rows(m, q, v, tau, external, passive, 0);
    NewArray du({size(m.nv())}, {}), loads({size(m.n_joints()), 6}, {});
    DynamicsReport report;
    {
      const GilReleased released;
      report = method_->evaluate(t, rows.input(m, 0), du.data, loads.data);
      if (report.ok() && !(all_finite({du.data, size(m.nv())}) &&
                           all_finite({loads.data, size(6 * m.n_joints())})))
        report.outcome = Outcome::not_finite;
      if (accept && report.ok()) method_->accepted(t);
    }
    return nb::make_tuple(du.array, loads.array, evaluation_report(m, choice_, report));
  }

  nb::dict follow(nb::handle times, nb::handle q, nb::handle v, nb::handle tau, nb::handle external,
                  bool passive, double time_limit);

 private:
  std::shared_ptr<const Model> model_;
  Choice choice_;
  DynamicsOptions options_;
  std::unique_ptr<DynamicsMethod> method_;
};

nb::dict PyDynamicsMethod::follow(nb::handle times_in, nb::handle q, nb::handle v, nb::handle tau,
                                  nb::handle external, bool passive, double time_limit) {
  const Model& m = *model_;
  const StateRows rows(m, q, v, tau, external, passive, 1);
  const ArrayIn times = as_array(times_in, "times");
  if (times.ndim() != 1 || times.size() != rows.count)
    throw InputError("times has shape " + shape_text(shape_of(times)) + " but there are " +
                     std::to_string(rows.count) + " states");
  NewArray du({rows.count}, {size(m.nv())});
  std::vector<double> seconds, iterations, errors;
  std::vector<Outcome> outcomes;
  bool bounds = true;
  Interrupt interrupt;
  {
    const GilReleased released;
    const Clock::time_point begin = Clock::now();
    for (size_t i = 0; i < rows.count && !interrupt(); ++i) {
      const SweepInput<double> in = rows.input(m, i);
      const Clock::time_point started = Clock::now();
      DynamicsReport report = method_->evaluate(times.data()[i], in, du.data + i * m.nv(), nullptr);
      if (report.ok() && !all_finite({du.data + i * m.nv(), size(m.nv())}))
        report.outcome = Outcome::not_finite;
      seconds.push_back(seconds_since(started));
      iterations.push_back(report.iterations);
      errors.push_back(report.error_estimate);
      bounds &= report.error_is_bound;
      outcomes.push_back(report.outcome);
      method_->accepted(times.data()[i]);
      if (seconds_since(begin) > time_limit) break;
    }
  }
  interrupt.rethrow();
  nb::list names;
  for (Outcome outcome : outcomes) names.append(std::string(to_string(outcome)));
  nb::dict out;
  out["acceleration"] =
      nb::cast(du.array)[nb::slice(nb::int_(0), nb::int_(outcomes.size()), nb::int_(1))];
  out["seconds"] = to_numpy(seconds);
  out["iterations"] = nb::cast(to_numpy(iterations)).attr("astype")("int64");
  out["error_estimate"] = to_numpy(errors);
  out["error_is_bound"] = bounds;
  out["outcome"] = names;
  return out;
}

nb::list initial_guess_list() {
  nb::list out;
  for (const InitialGuessEntry& e : initial_guess_table()) {
    nb::dict d;
    d["name"] = std::string(e.name);
    d["description"] = std::string(e.description);
    d["reference"] = std::string(e.reference);
    out.append(d);
  }
  return out;
}

nb::list stop_rule_list() {
  nb::list out;
  for (const StopRuleEntry& e : stop_rule_table()) {
    nb::dict d;
    d["name"] = std::string(e.name);
    d["description"] = std::string(e.description);
    out.append(d);
  }
  return out;
}

void bind_spectrum(nb::module_& m) {
  nb::class_<Spectrum>(
      m, "Spectrum",
      R"(Extreme eigenvalues of D^-1 A, D the block diagonal of A, by the Lanczos process
[golub2013].)")
      .def_ro("smallest", &Spectrum::smallest, "Smallest eigenvalue; it has no unit.")
      .def_ro("largest", &Spectrum::largest, "Largest eigenvalue; it has no unit.")
      .def_ro("steps", &Spectrum::steps, "Lanczos steps taken.")
      .def_ro("converged", &Spectrum::converged, "Whether both eigenvalues have settled.")
      .def(
          "__getstate__",
          [](const Spectrum& s) { return std::tuple(s.smallest, s.largest, s.steps, s.converged); })
      .def("__setstate__",
           [](Spectrum& s, const std::tuple<double, double, int, bool>& state) {
             const auto& [smallest, largest, steps, converged] = state;
             new (&s) Spectrum{smallest, largest, steps, converged};
           })
      .def_prop_ro("condition", &Spectrum::condition, "Condition number: largest / smallest.")
      .def_prop_ro("radius", &Spectrum::radius, "Spectral radius of Jacobi's 1 - D^-1 A.");
}

void bind_system(nb::module_& m) {
  nb::class_<PyConstraintSystem>(
      m, "ConstraintSystem",
      R"(The system A f = b of a model's joint constraint forces at one state [sharf1993].

A is symmetric positive definite and follows the joints: a block row per joint, with as many rows as
the joint constrains directions. f holds forces [N] and moments [N m], b relative accelerations
[m/s2, rad/s2]; both in the frames of the core, whose joint axes are z.)")
      .def(nb::init<const PyModel&, nb::handle, nb::handle, nb::handle, nb::handle, bool>(),
           "model"_a, "q"_a, "v"_a = nb::none(), "tau"_a = nb::none(), nb::kw_only(),
           "external"_a = nb::none(), "passive"_a = false,
           "Assembles the system at a state.\n\n"
           "Args:\n    model: the machine.\n"
           "    q: positions (nq,) [rad, m]; v: rates (nv,) [rad/s, m/s]; tau: (nv,) [N m, N].\n"
           "    external: wrenches (n_joints, 6) [N, N m] as in forward_dynamics.\n"
           "    passive: adds the model's damping, friction, springs and stops to tau.\n\n"
           "Raises:\n    InputError: shapes do not fit the model, or a number is not finite.")
      .def_prop_ro(
          "size", [](const PyConstraintSystem& s) { return s.A().size(); },
          "Number of unknowns: constrained directions of all joints.")
      .def_prop_ro(
          "b", &PyConstraintSystem::right_hand_side, nb::rv_policy::move,
          R"(Right-hand side (size,) [m/s2, rad/s2]: what the joints would open by without f.)")
      .def_prop_ro(
          "rows_per_joint",
          [](const PyConstraintSystem& s) {
            nb::list out;
            for (int n : s.A().dim) out.append(n);
            return out;
          },
          R"(Constrained directions of each body's inboard joint, in the order of the rows of A.)")
      .def("rows", &PyConstraintSystem::rows, "joint"_a,
           R"(Slice of f that belongs to a joint, given by its name; InputError for unknown
joints.)")
      .def("dense", &PyConstraintSystem::dense,
           R"(A as an array (size, size) [1/kg, 1/(kg m), 1/(kg m2)].)")
      .def("sparse", &PyConstraintSystem::sparse, R"(A as a scipy.sparse.csr_array (size, size).)")
      .def("multiply", &PyConstraintSystem::multiply, "f"_a,
           R"(A f (size,) [m/s2, rad/s2] of forces f (size,) [N, N m]; InputError for another
shape.)")
      .def("energy_norm", &PyConstraintSystem::energy_norm, "f"_a,
           R"(sqrt(f^T A f) of f (size,) [N, N m]: for an error in f the kinetic-energy norm of the
acceleration error. InputError for another shape.)")
      .def("solve", &PyConstraintSystem::solve, "solver"_a = "thomas", nb::kw_only(),
           "guess"_a = nb::none(), "tolerance"_a = 1e-12, "stop"_a = "energy_norm",
           "max_iterations"_a = 0, "solver_options"_a = nb::none(),
           R"(Solves A f = b.

Args:
    solver: a name of linkwise.solvers(), which cites its source.
    guess: where iterations start (size,) [N, N m]; None: zero.
    tolerance, stop: when they end; stop is a name of linkwise.stop_rules().
    max_iterations: 0: the solver's own limit.
    solver_options: further options by name, as in linkwise.solver_options().

Returns:
    f (size,) [N, N m] and a Report. A solve that fails says so there and returns what it has.

Raises:
    InputError: a name is unknown, an option unusable, or the guess has another shape.)")
      .def("recover", &PyConstraintSystem::recover, "f"_a,
           R"(What constraint forces f (size,) [N, N m] lead to.

Returns:
    Accelerations (nv,) [rad/s2, m/s2], and joint loads (n_joints, 6) [N, N m] as of joint_loads.

Raises:
    InputError: f has another shape.)")
      .def("spectrum", &PyConstraintSystem::spectrum, nb::kw_only(), "max_steps"_a = 0,
           R"(Extreme eigenvalues of D^-1 A: a Spectrum, by at most max_steps Lanczos steps; 0: as
many as needed.)")
      .def(
          "condition_estimate",
          [](const PyConstraintSystem& s) { return s.spectrum(0).condition(); },
          R"(Condition number of D^-1 A, D the block diagonal of A; it has no unit.)")
      .def(
          "spectral_radius", [](const PyConstraintSystem& s) { return s.spectrum(0).radius(); },
          "Spectral radius of Jacobi's iteration matrix 1 - D^-1 A; it converges below 1.");
}

void make_method(PyDynamicsMethod* self, const PyModel& model, const std::string& method,
                 const std::string& solver, const std::string& guess, double tolerance,
                 const std::string& stop, int max_iterations, nb::handle solver_options,
                 nb::handle threads) {
  DynamicsOptions options;
  options.executor = executor_for(whole_number(threads, "threads"));
  options.method = method;
  options.solver = solver;
  options.initial_guess = guess;
  options.solver_options.tolerance = tolerance;
  options.solver_options.stop = stop_rule_from_name(stop);
  options.solver_options.max_iterations = max_iterations;
  set_options(options.solver_options, solver_option_values(solver_options));
  refuse_loops(*model.model, "DynamicsMethod", "use forward_dynamics");
  new (self) PyDynamicsMethod(model, std::move(options));
}

void bind_dynamics_method(nb::module_& m) {
  nb::class_<PyDynamicsMethod>(
      m, "DynamicsMethod",
      R"(A method of forward dynamics with its memory: an iterative solver starts from the
solutions of earlier times, as in a simulation. linkwise.forward_dynamics remembers nothing.)")
      .def("__init__", &make_method, "model"_a, nb::kw_only(), "method"_a = "auto",
           "solver"_a = "auto", "initial_guess"_a = "cubic", "tolerance"_a = 1e-7,
           "stop"_a = "energy_norm", "max_iterations"_a = 0, "solver_options"_a = nb::none(),
           "threads"_a = nb::none(),
           R"(Args:
    model: the machine.
    method, solver: names of linkwise.methods() and linkwise.solvers(); "auto" chooses.
    initial_guess: a name of linkwise.initial_guesses().
    tolerance, stop, max_iterations, solver_options: of iterative solvers, as in
        ConstraintSystem.solve.
    threads: how many share one evaluation; None: LINKWISE_THREADS or all cores.

Raises:
    InputError: a name is unknown or an option unusable.)")
      .def("evaluate", &PyDynamicsMethod::evaluate, "t"_a, "q"_a, "v"_a = nb::none(),
           "tau"_a = nb::none(), nb::kw_only(), "external"_a = nb::none(), "passive"_a = false,
           "accept"_a = true,
           R"(Forward dynamics at one time.

Args:
    t: the time [s], which guesses extrapolate to.
    q: positions (nq,) [rad, m]; v: rates (nv,) [rad/s, m/s], None: at rest;
        tau: joint torques and forces (nv,) [N m, N], None: zero.
    external: wrenches (n_joints, 6) [N, N m] as in forward_dynamics.
    passive: adds the model's damping, friction, springs and stops to tau.
    accept: later guesses may build on this evaluation.

Returns:
    Accelerations (nv,) [rad/s2, m/s2], joint loads (n_joints, 6) [N, N m] as of joint_loads, and a
    Report, which says so where the method failed.

Raises:
    InputError: shapes do not fit the model, or a number is not finite.)")
      .def("follow", &PyDynamicsMethod::follow, "times"_a, "q"_a, "v"_a = nb::none(),
           "tau"_a = nb::none(), nb::kw_only(), "external"_a = nb::none(), "passive"_a = false,
           "time_limit"_a = std::numeric_limits<double>::infinity(),
           R"(One evaluation per state, one after the other, all accepted.

Args:
    times: (n,) [s].
    q: positions (n, nq) [rad, m]; v: rates (n, nv) [rad/s, m/s], None: at rest;
        tau: joint torques and forces (n, nv) [N m, N], None: zero.
    external: wrenches (n, n_joints, 6) [N, N m] as in forward_dynamics.
    passive: adds the model's damping, friction, springs and stops to tau.
    time_limit: stop after so many seconds of computing [s].

Returns:
    A dictionary of acceleration (n, nv) [rad/s2, m/s2], seconds, iterations, error_estimate (n,)
    and outcome, shorter when time_limit has passed; error_is_bound is one for all.

Raises:
    InputError: shapes do not fit the model or each other, or a number is not finite.)")
      .def_prop_ro(
          "constraint_force", &PyDynamicsMethod::constraint_force, nb::rv_policy::move,
          R"(f (unknowns,) [N, N m] of the last evaluation; empty of a method without a solver.)")
      .def("reset", &PyDynamicsMethod::reset, "Forget earlier times.")
      .def_prop_ro(
          "method", [](const PyDynamicsMethod& s) { return s.choice().method; },
          "The method's name, also where \"auto\" was asked for.")
      .def_prop_ro(
          "solver", [](const PyDynamicsMethod& s) { return s.choice().solver; },
          "The linear solver's name; empty where the method uses none.");
}

}  // namespace

void bind_solve(nb::module_& m) {
  bind_spectrum(m);
  bind_system(m);
  bind_dynamics_method(m);
  m.def("initial_guesses", &initial_guess_list,
        R"(The table of initial guesses: dictionaries of name, description, reference.)");
  m.def("stop_rules", &stop_rule_list,
        R"(The stop rules of iterative solvers: dictionaries of name, description.)");
  m.def("solver_options", &solver_option_list,
        R"(The keys of solver_options={...}: dictionaries of name, default, description.)");
}

}  // namespace linkwise::bindings
