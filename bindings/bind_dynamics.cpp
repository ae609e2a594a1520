#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "bind.hpp"
#include "linkwise/constraint/joint_constraint.hpp"
#include "linkwise/integrate/integrator.hpp"
#include "linkwise/solve/registry.hpp"
#include "report.hpp"
#include "solver_options.hpp"
#include "states.hpp"

namespace linkwise::bindings {
namespace {

struct ForwardResult {
  nb::object acceleration, joint_load, constraint_force;
  PyReport report;
};

void check_gravity(double factor) {
  if (!std::isfinite(factor))
    throw InputError("gravity is not finite; give a factor, 1 for the model's gravity, 0 for none");
}

struct ForwardOptions {
  std::string method, solver, stop;
  double tolerance;
  int max_iterations;
  nb::handle solver_options;
};

DynamicsOptions dynamics_options(const ForwardOptions& o) {
  DynamicsOptions options;
  options.method = o.method;
  options.solver = o.solver;
  options.solver_options.tolerance = o.tolerance;
  options.solver_options.max_iterations = o.max_iterations;
  options.solver_options.stop = stop_rule_from_name(o.stop);
  read_solver_options(o.solver_options, options);
  return options;
}

/// What to bring back: accelerations alone, with joint loads, or everything there is to tell.
enum class Wanted { accelerations, loads, full };

/// Runs the chosen method on every system; force is [count][unknowns] when wanted.
Outcome run_method(const Model& m, DynamicsMethod& method, const States& s, const double* tau,
                   double gravity, double* du, double* loads, std::vector<double>* force,
                   PyReport& report, Interrupt& interrupt) {
  Outcome worst = Outcome::converged;
  std::vector<double> zero(m.nv());
  for (size_t i = 0; i < s.count && !interrupt(); ++i) {
    SweepInput<double> in;
    in.q = s.q.data + i * m.nq();
    in.v = s.v.given ? s.v.data + i * m.nv() : zero.data();
    in.tau = tau ? tau + i * m.nv() : zero.data();
    in.external = s.external.given ? s.external.data + i * 6 * m.n_joints() : nullptr;
    in.prescribed = s.prescribed.given ? s.prescribed.data + i * m.nv() : zero.data();
    in.gravity_factor = gravity;
    const DynamicsReport r =
        method.evaluate(0, in, du + i * m.nv(), loads ? loads + i * 6 * m.n_joints() : nullptr);
    report.iterations = std::max(report.iterations, r.iterations);
    report.error_estimate = std::max(report.error_estimate, r.error_estimate);
    if (!r.ok()) {
      worst = r.outcome;
      if (r.body >= 0) report.body = m.body_name(r.body);
    }
    if (force)
      force->insert(force->end(), method.constraint_force().begin(),
                    method.constraint_force().end());
  }
  return worst;
}

nb::object forward_dynamics(const PyModel& self, nb::handle q, nb::handle v, nb::handle tau,
                            nb::handle external, bool passive, const std::string& method,
                            const std::string& solver, double tolerance, const std::string& stop,
                            int max_iterations, nb::handle solver_options, nb::handle threads,
                            Wanted wanted, double gravity, nb::handle prescribed) {
  const Model& m = *self.model;
  const bool full = wanted == Wanted::full, with_loads = wanted != Wanted::accelerations;
  States s(m, q, v, tau, "tau", external, prescribed);
  check_external(m, s);
  check_gravity(gravity);
  check_prescribed(m, s);
  const ForwardOptions asked{method, solver, stop, tolerance, max_iterations, solver_options};
  const bool plain = (method == "auto" || method == "articulated_body") && solver == "auto";
  // Options that nobody touched need no reading, which costs as much as a small machine's dynamics.
  const bool untouched = tolerance == 1e-12 && stop == "energy_norm" && max_iterations == 0 &&
                         solver_options.is_none();
  const int team = threads_of(threads, s.count * m.n_bodies());
  PyReport report;
  std::unique_ptr<DynamicsMethod> own;
  DynamicsMethod* other = nullptr;
  PyModel::Lease scratch(self);
  BatchMethod on_lanes = BatchMethod::articulated_body;
  if (plain && s.count == 1 && scratch->cut()) {
    const Choice choice =
        method == "auto" ? scratch->default_choice() : Choice{method, "", "as asked for"};
    other = &scratch->method(choice.method, team);
    report.method = choice.method;
    report.solver = choice.solver;
    if (!untouched) dynamics_options(asked);
    if (full) report.reason = choice.reason;
  } else if (plain) {
    report.method = "articulated_body";
    if (untouched && method == "auto" && scratch->default_choice().method == report.method)
      report.reason = full ? scratch->default_choice().reason : "";
    else if (full || !untouched)
      report.reason = choose_dynamics(m, dynamics_options(asked)).reason;
  } else {
    DynamicsOptions options = dynamics_options(asked);
    options.threads = team;
    const Choice choice = choose_dynamics(m, options);
    report.method = choice.method;
    report.solver = choice.solver;
    report.reason = choice.reason;
    if (s.count > 1 && !full && untouched && choice.method == "constraint_force" &&
        choice.solver == "thomas") {
      require_regular_inertias(m);
      on_lanes = BatchMethod::constraint_force;
    } else {
      own = make_dynamics(m, options);
      other = own.get();
    }
  }
  const double scratch_bytes = 8.0 * s.count * m.nv() * (passive || !s.tau.given);
  const double result_bytes = 8.0 * s.count * (m.nv() + (with_loads ? 6.0 * m.n_joints() : 0));
  if (scratch_bytes + result_bytes > worth_a_check)
    require_memory(scratch_bytes + result_bytes,
                   "forward dynamics of " + std::to_string(s.count) + " states");
  NewArray du(s.lead, {size(m.nv())});
  std::unique_ptr<NewArray> loads;
  if (with_loads) loads = std::make_unique<NewArray>(s.lead, Shape{size(m.n_joints()), 6});
  std::vector<double> passive_tau, force;
  Outcome outcome = Outcome::converged;
  Interrupt interrupt;
  {
    const nb::gil_scoped_release release;
    const double* total = s.tau.given ? s.tau.data : nullptr;
    if (passive || !total) {
      if (passive && m.has_passive_forces())
        passive_tau = with_passive(m, s, total);
      else if (!total)
        passive_tau.assign(s.count * m.nv(), 0.0);
      if (!passive_tau.empty()) total = passive_tau.data();
    }
    if (other) {
      outcome = run_method(m, *other, s, total, gravity, du.data, loads ? loads->data : nullptr,
                           full ? &force : nullptr, report, interrupt);
    } else {
      BatchInput in;
      in.q = s.q.data;
      in.v = s.v.given ? s.v.data : nullptr;
      in.tau = total;
      in.external = s.external.given ? s.external.data : nullptr;
      in.du = s.prescribed.given ? s.prescribed.data : nullptr;
      in.gravity_factor = gravity;
      std::atomic<int> body{-1};
      const auto part = [&](BatchEvaluator& batch, size_t first, size_t count) {
        const int failed = batch.forward_dynamics(
            count, rows_from(m, in, first), du.data + first * m.nv(),
            loads ? loads->data + first * 6 * m.n_joints() : nullptr, on_lanes);
        for (int seen = body; failed > seen && !body.compare_exchange_weak(seen, failed);) {
        }
      };
      over_parts(m, s.count, team, interrupt, [&](size_t first, size_t count) {
        if (count == s.count) return part(scratch->batch, first, count);
        PyModel::Lease own_scratch(self);
        part(own_scratch->batch, first, count);
      });
      if (body >= 0) {
        outcome = Outcome::not_positive_definite;
        report.body = m.body_name(body);
      }
    }
  }
  interrupt.rethrow();
  report.outcome = to_string(outcome);
  if (!full) {
    if (outcome != Outcome::converged) throw NumericsError(failure_text(m, report, outcome));
    return with_loads ? loads->array : du.array;
  }
  ForwardResult result;
  result.acceleration = du.array;
  result.joint_load = loads->array;
  result.constraint_force = nb::none();
  if (other && !other->constraint_force().empty()) {
    NewArray f(s.lead, {other->constraint_force().size()});
    std::copy(force.begin(), force.end(), f.data);
    result.constraint_force = f.array;
  }
  result.report = std::move(report);
  return nb::cast(std::move(result));
}

nb::object inverse_dynamics(const PyModel& self, nb::handle q, nb::handle v, nb::handle a,
                            nb::handle external, double gravity, nb::handle threads, bool loads) {
  const Model& m = *self.model;
  States s(m, q, v, a, "acceleration", external);
  check_external(m, s);
  check_gravity(gravity);
  NewArray out(s.lead, loads ? Shape{size(m.n_joints()), 6} : Shape{size(m.nv())});
  const int team = threads_of(threads, s.count * m.n_bodies());
  Interrupt interrupt;
  {
    const nb::gil_scoped_release release;
    BatchInput in;
    in.q = s.q.data;
    in.v = s.v.given ? s.v.data : nullptr;
    in.du = s.tau.given ? s.tau.data : nullptr;
    in.external = s.external.given ? s.external.data : nullptr;
    in.gravity_factor = gravity;
    const size_t width = loads ? 6 * m.n_joints() : m.nv();
    over_parts(m, s.count, team, interrupt, [&](size_t first, size_t count) {
      PyModel::Lease scratch(self);
      double* rows = out.data + first * width;
      scratch->batch.inverse_dynamics(count, rows_from(m, in, first), loads ? nullptr : rows,
                                      loads ? rows : nullptr);
    });
  }
  interrupt.rethrow();
  return out.array;
}

nb::object joint_loads(const PyModel& self, nb::handle q, nb::handle v, nb::handle tau,
                       nb::handle external, bool passive, const std::string& method,
                       const std::string& solver, nb::handle threads) {
  return forward_dynamics(self, q, v, tau, external, passive, method, solver, 1e-12, "energy_norm",
                          0, nb::none(), threads, Wanted::loads, 1.0, nb::none());
}

nb::list solver_list() {
  nb::list out;
  for (const SolverEntry& e : solver_table()) {
    nb::dict d;
    d["name"] = std::string(e.name);
    d["description"] = std::string(e.description);
    d["kind"] = std::string(to_string(e.kind));
    d["parallel"] = e.parallel;
    d["reference"] = std::string(e.reference);
    out.append(d);
  }
  return out;
}

nb::list method_list() {
  nb::list out;
  for (const DynamicsEntry& e : dynamics_table()) {
    nb::dict d;
    d["name"] = std::string(e.name);
    d["description"] = std::string(e.description);
    d["reference"] = std::string(e.reference);
    d["uses_solver"] = e.uses_solver;
    d["chains_only"] = e.chains_only;
    d["linear_time"] = e.linear_time;
    out.append(d);
  }
  return out;
}

nb::list integrator_list() {
  nb::list out;
  for (const IntegratorEntry& e : integrator_registry()) {
    nb::dict d;
    d["name"] = std::string(e.name);
    d["description"] = std::string(e.description);
    d["fixed_step"] = e.fixed_step;
    out.append(d);
  }
  return out;
}

void bind_results(nb::module_& m) {
  nb::exception<NumericsError>(m, "NumericsError", PyExc_RuntimeError).attr("__module__") =
      "linkwise";
  nb::class_<PyReport>(m, "Report", "How an evaluation went.")
      .def_ro("outcome", &PyReport::outcome)
      .def_ro("method", &PyReport::method)
      .def_ro("solver", &PyReport::solver)
      .def_ro("reason", &PyReport::reason, "Why this method and solver.")
      .def_ro("body", &PyReport::body, "Where it failed, or empty.")
      .def_ro("iterations", &PyReport::iterations)
      .def_ro("error_estimate", &PyReport::error_estimate,
              "Relative A-norm error of the constraint forces.")
      .def("__repr__", [](const PyReport& r) {
        return "Report(" + r.outcome + ", method " + r.method +
               (r.solver.empty() ? "" : ", solver " + r.solver) + ", " +
               std::to_string(r.iterations) + " iterations)";
      });
  nb::class_<ForwardResult>(m, "ForwardDynamicsResult")
      .def_ro("acceleration", &ForwardResult::acceleration, "(..., nv)")
      .def_ro("joint_load", &ForwardResult::joint_load,
              "(..., n_joints, 6), N and N m, joint frame, joint point.")
      .def_ro("constraint_force", &ForwardResult::constraint_force,
              "(..., unknowns) of A f = b, or None.")
      .def_ro("report", &ForwardResult::report);
}

}  // namespace

void bind_dynamics(nb::module_& m) {
  bind_results(m);
  m.def(
      "forward_dynamics",
      [](const PyModel& self, nb::handle q, nb::handle v, nb::handle tau, nb::handle external,
         bool passive, const std::string& method, const std::string& solver, double tolerance,
         const std::string& stop, int max_iterations, nb::handle solver_options, nb::handle threads,
         bool full, double gravity, nb::handle prescribed) {
        return forward_dynamics(self, q, v, tau, external, passive, method, solver, tolerance, stop,
                                max_iterations, solver_options, threads,
                                full ? Wanted::full : Wanted::accelerations, gravity, prescribed);
      },
      "model"_a, "q"_a, "v"_a.none(), "tau"_a = nb::none(), nb::kw_only(),
      "external"_a = nb::none(), "passive"_a = false, "method"_a = "auto", "solver"_a = "auto",
      "tolerance"_a = 1e-12, "stop"_a = "energy_norm", "max_iterations"_a = 0,
      "solver_options"_a = nb::none(), "threads"_a = nb::none(), "full"_a = false,
      "gravity"_a = 1.0, "prescribed"_a = nb::none(),
      "Accelerations dv/dt (..., nv) [rad/s2, m/s2] of q (..., nq), v (..., nv), tau (..., nv); "
      "leading axes broadcast.\n\n"
      "external (..., n_joints, 6): wrench [N, N m] on each body at its joint frame's origin, in "
      "that frame, force\n"
      "first. passive adds the model's damping, friction, springs and stops to tau. method and "
      "solver: names as in\n"
      "linkwise.methods() and linkwise.solvers(), \"auto\" chooses; tolerance, stop and "
      "max_iterations concern\n"
      "iterative solvers; solver_options is a dictionary of further ones (keys as in "
      "linkwise.solver_options()) and goes first.\n"
      "threads: by default LINKWISE_THREADS or all cores; the result is the same to the last bit.\n"
      "full returns a ForwardDynamicsResult with joint loads, constraint "
      "forces and Report.\n"
      "gravity multiplies the model's gravity, 0 leaves it out; prescribed (..., nv) holds the "
      "accelerations of the joints\n"
      "of model.prescribe, the other entries are not read.\n"
      "Raises InputError (a ValueError) on wrong shapes or values, NumericsError when the method "
      "fails.");
  m.def(
      "inverse_dynamics",
      [](const PyModel& self, nb::handle q, nb::handle v, nb::handle a, nb::handle external,
         double gravity, nb::handle threads) {
        return inverse_dynamics(self, q, v, a, external, gravity, threads, false);
      },
      "model"_a, "q"_a, "v"_a.none(), "acceleration"_a.none(), nb::kw_only(),
      "external"_a = nb::none(), "gravity"_a = 1.0, "threads"_a = nb::none(),
      "tau (..., nv) [N m, N] that gives the acceleration (..., nv) at q, v: Newton-Euler "
      "recursion, armature included.");
  m.def(
      "inverse_dynamics_loads",
      [](const PyModel& self, nb::handle q, nb::handle v, nb::handle a, nb::handle external,
         double gravity, nb::handle threads) {
        return inverse_dynamics(self, q, v, a, external, gravity, threads, true);
      },
      "model"_a, "q"_a, "v"_a.none(), "acceleration"_a.none(), nb::kw_only(),
      "external"_a = nb::none(), "gravity"_a = 1.0, "threads"_a = nb::none(),
      "Joint loads (..., n_joints, 6) of a given motion, frames and signs as in joint_loads; "
      "gravity "
      "multiplies the\n"
      "model's gravity.");
  m.def("joint_loads", &joint_loads, "model"_a, "q"_a, "v"_a.none(), "tau"_a = nb::none(),
        nb::kw_only(), "external"_a = nb::none(), "passive"_a = false, "method"_a = "auto",
        "solver"_a = "auto", "threads"_a = nb::none(),
        "Joint loads (..., n_joints, 6) [N, N m] of the motion that tau causes: the wrench that "
        "the inboard body exerts on\n"
        "the outboard body through the joint, at the joint point, in the joint's outboard frame, "
        "force first.");
  m.def("solvers", &solver_list, "The table of linear solvers, as dictionaries.");
  m.def("methods", &method_list, "The table of dynamics methods, as dictionaries.");
  m.def("integrators", &integrator_list, "The table of integrators, as dictionaries.");
}

}  // namespace linkwise::bindings
