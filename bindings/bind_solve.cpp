// Solvers from Python: the tables of guesses, stop rules and options; the system A f = b of a model
// at a state, to look at and to solve; and a dynamics method that keeps its warm starts between
// calls.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "linkwise/dynamics/constraint_system.hpp"
#include "linkwise/dynamics/graph_spectrum.hpp"
#include "linkwise/dynamics/method_over_time.hpp"
#include "linkwise/linear/triplets.hpp"
#include "linkwise/solve/registry.hpp"
#include "linkwise/solve/spectrum.hpp"
#include "report.hpp"
#include "solver_options.hpp"
#include "states.hpp"
#include "table_rows.hpp"

namespace linkwise::bindings {
namespace {

/// States with at most so many leading axes.
States states_of(const Model& m, nb::handle q, nb::handle v, nb::handle tau, nb::handle external,
                 size_t most_axes) {
  States s(m, q, v, tau, "tau", external);
  if (s.lead.size() > most_axes)
    throw InputError("q has shape " + shape_text(shape_of(s.q.array)) + "; at most " +
                     std::to_string(most_axes + 1) + " axes are expected");
  return s;
}

BatchInput input_of(const States& states, bool passive) {
  BatchInput in = states.input();
  in.passive_acts = passive;
  return in;
}

/// A f = b of a model at one state. Keeps the model alive.
class PyConstraintSystem {
 public:
  PyConstraintSystem(const PyModel& owner, nb::handle q, nb::handle v, nb::handle tau,
                     nb::handle external, bool passive)
      : model_(owner.model),
        system_(*model_, input_of(states_of(*model_, q, v, tau, external, 0), passive)) {
    if (!system_.finite()) refuse_result();
  }

  const BlockTree& A() const { return system_.A(); }
  nb::object b() const { return read_only(to_numpy(system_.b())); }

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
    const double norm = system_.energy_norm(unknowns(x, "f"));
    check_result(&norm, 1);
    return norm;
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
                  const std::string& stop, int max_iterations, nb::handle given_options) {
    const SolverOptions options =
        make_solver_options(tolerance, stop, max_iterations, solver_option_values(given_options));
    std::vector<double> f =
        guess.is_none() ? std::vector<double>(A().size()) : unknowns(guess, "guess");
    const EvaluationReport report = [&] {
      const GilReleased released;
      return system_.solve(solver, options, f);
    }();
    return nb::make_tuple(to_numpy(f), report);
  }

  nb::tuple recover(nb::handle f) {
    NewArray du({size(model_->nv())}, {}), loads({size(model_->n_joints()), 6}, {});
    system_.recover(unknowns(f, "f"), du.data, loads.data);
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
  std::shared_ptr<const Model> model_;
  ConstraintSystem system_;
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

/// Keeps the model alive.
class PyDynamicsMethod {
 public:
  PyDynamicsMethod(const PyModel& owner, DynamicsOptions options)
      : model_(owner.model), method_(*model_, std::move(options)) {}

  const Choice& choice() const { return method_.choice(); }
  nb::object constraint_force() const {
    const std::span<const double> f = method_.constraint_force();
    return read_only(to_numpy({f.begin(), f.end()}));
  }
  void reset() { method_.reset(); }

  nb::tuple evaluate(double t, nb::handle q, nb::handle v, nb::handle tau, nb::handle external,
                     bool passive, bool accept) {
    const Model& m = *model_;
    const States state = states_of(m, q, v, tau, external, 0);
    NewArray du({size(m.nv())}, {}), loads({size(m.n_loads()), 6}, {});
    const EvaluationReport report = [&] {
      const GilReleased released;
      return method_.evaluate(t, input_of(state, passive), du.data, loads.data, accept);
    }();
    return nb::make_tuple(du.array, loads.array, report);
  }

  nb::dict follow(nb::handle times, nb::handle q, nb::handle v, nb::handle tau, nb::handle external,
                  bool passive, double time_limit);

 private:
  std::shared_ptr<const Model> model_;
  MethodOverTime method_;
};

nb::dict PyDynamicsMethod::follow(nb::handle times_in, nb::handle q, nb::handle v, nb::handle tau,
                                  nb::handle external, bool passive, double time_limit) {
  const Model& m = *model_;
  const States states = states_of(m, q, v, tau, external, 1);
  const ArrayIn times = as_array(times_in, "times");
  if (times.ndim() != 1 || times.size() != states.count)
    throw InputError("times has shape " + shape_text(shape_of(times)) + " but there are " +
                     std::to_string(states.count) + " states");
  NewArray du({states.count}, {size(m.nv())});
  const std::vector<MethodOverTime::Step> steps = without_gil([&](const GoOn& go_on) {
    return method_.follow({times.data(), times.size()}, input_of(states, passive), du.data,
                          time_limit, go_on);
  });
  std::vector<double> seconds, iterations, errors;
  nb::list outcomes;
  bool bounds = true;
  for (const MethodOverTime::Step& step : steps) {
    seconds.push_back(step.seconds);
    iterations.push_back(step.iterations);
    errors.push_back(step.error_estimate);
    outcomes.append(std::string(to_string(step.outcome)));
    bounds &= step.error_is_bound;
  }
  nb::dict out;
  out["acceleration"] =
      nb::cast(du.array)[nb::slice(nb::int_(0), nb::int_(steps.size()), nb::int_(1))];
  out["seconds"] = to_numpy(seconds);
  out["iterations"] = nb::cast(to_numpy(iterations)).attr("astype")("int64");
  out["error_estimate"] = to_numpy(errors);
  out["error_is_bound"] = bounds;
  out["outcome"] = outcomes;
  return out;
}

nb::list initial_guess_list() {
  return table_rows(initial_guess_table(), [](auto&& row, const InitialGuessEntry& e) {
    row("name", e.name);
    row("description", e.description);
    row("reference", e.reference);
  });
}

nb::list stop_rule_list() {
  return table_rows(stop_rule_table(), [](auto&& row, const StopRuleEntry& e) {
    row("name", e.name);
    row("description", e.description);
  });
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
  const SolverOptions usual = evaluation_options().solver_options;
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
          "b", &PyConstraintSystem::b, nb::rv_policy::move,
          R"(Right-hand side (size,) [m/s2, rad/s2]: what the joints would open by without f.)")
      .def_prop_ro(
          "rows_per_joint", [](const PyConstraintSystem& s) { return s.A().dim; },
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
           "guess"_a = nb::none(), "tolerance"_a = usual.tolerance,
           "stop"_a = std::string(to_string(usual.stop)), "max_iterations"_a = usual.max_iterations,
           "solver_options"_a = nb::none(),
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

void bind_graph_spectrum(nb::module_& m) {
  nb::class_<GraphSpectrum>(
      m, "GraphSpectrum",
      "What conjugate gradients meet on a machine with closed loops or flexible links.")
      .def_ro("unknowns", &GraphSpectrum::unknowns, "Joint constraint forces.")
      .def_ro("found", &GraphSpectrum::found,
              "Spectrum of P^-1 A, P the block diagonal with rigid knots whole.")
      .def_prop_ro(
          "bound",
          [](const GraphSpectrum& s) { return std::tuple(s.bound.smallest, s.bound.largest); },
          "Between which numbers it lies, by the bodies one by one [wathen1987]; smallest 0: there "
          "is no bound.")
      .def(
          "iterations",
          [](const GraphSpectrum& s, double tolerance) { return s.bound.iterations(tolerance); },
          "tolerance"_a,
          "Iterations, at most, that take the error's energy norm down to that part.");
  m.def(
      "graph_spectrum",
      [](const PyModel& model, nb::handle q) {
        const States s = states_of(*model.model, q, nb::none(), nb::none(), nb::none(), 0);
        return graph_spectrum(*model.model, s.q.data);
      },
      "model"_a, "q"_a,
      R"(The spectrum of A f = b that conjugate gradients meet at position q (nq,) [rad, m].

Raises:
    InputError: q does not fit, or the model has what method constraint_force does not take.)");
}

void make_method(PyDynamicsMethod* self, const PyModel& model, const std::string& method,
                 const std::string& solver, const std::string& guess, double tolerance,
                 const std::string& stop, int max_iterations, nb::handle given_options,
                 nb::handle threads) {
  new (self) PyDynamicsMethod(
      model, {.method = method,
              .solver = solver,
              .initial_guess = guess,
              .executor = executor_for(whole_number(threads, "threads")),
              .solver_options = make_solver_options(tolerance, stop, max_iterations,
                                                    solver_option_values(given_options))});
}

void bind_dynamics_method(nb::module_& m) {
  const DynamicsOptions usual = MethodOverTime::usual_options();
  nb::class_<PyDynamicsMethod>(
      m, "DynamicsMethod",
      R"(A method of forward dynamics with its memory: an iterative solver starts from the
solutions of earlier times, as in a simulation. linkwise.forward_dynamics remembers nothing.)")
      .def("__init__", &make_method, "model"_a, nb::kw_only(), "method"_a = usual.method,
           "solver"_a = usual.solver, "initial_guess"_a = usual.initial_guess,
           "tolerance"_a = usual.solver_options.tolerance,
           "stop"_a = std::string(to_string(usual.solver_options.stop)),
           "max_iterations"_a = usual.solver_options.max_iterations,
           "solver_options"_a = nb::none(), "threads"_a = nb::none(),
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
    Accelerations (nv,) [rad/s2, m/s2], joint loads (n_joints + n_loops, 6) [N, N m] as of joint_loads, and a
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
  bind_graph_spectrum(m);
  bind_dynamics_method(m);
  m.def("initial_guesses", &initial_guess_list,
        R"(The table of initial guesses: dictionaries of name, description, reference.)");
  m.def("stop_rules", &stop_rule_list,
        R"(The stop rules of iterative solvers: dictionaries of name, description.)");
  m.def("solver_options", &solver_option_list,
        R"(The keys of solver_options={...}: dictionaries of name, default, description.)");
}

}  // namespace linkwise::bindings
