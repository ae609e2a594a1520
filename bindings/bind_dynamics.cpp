#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "doc_text.hpp"
#include "linkwise/dynamics/assembly.hpp"
#include "linkwise/integrate/integrator.hpp"
#include "linkwise/solve/registry.hpp"
#include "numbers.hpp"
#include "printable.hpp"
#include "report.hpp"
#include "solver_options.hpp"
#include "states.hpp"
#include "table_rows.hpp"

namespace linkwise::bindings {
namespace {

struct ForwardResult {
  nb::object acceleration, joint_load, constraint_force;
  EvaluationReport report;
};

/// What to return: accelerations alone, with joint loads, or everything.
enum class Wanted { accelerations, loads, full };

/// Options that are None keep the defaults of an evaluation.
DynamicsOptions options_of(const std::string& method, const std::string& solver,
                           nb::handle tolerance, nb::handle stop, nb::handle max_iterations,
                           nb::handle solver_options) {
  static const DynamicsOptions usual = evaluation_options();
  DynamicsOptions options = usual;
  options.method = method;
  options.solver = solver;
  SolverOptions& o = options.solver_options;
  if (!tolerance.is_none()) o.tolerance = real_number(tolerance, "tolerance");
  if (!stop.is_none()) o.stop = stop_rule_from_name(name_in(stop, "stop"));
  if (const auto most = whole_number(max_iterations, "max_iterations")) o.max_iterations = *most;
  set_options(o, solver_option_values(solver_options));
  return options;
}

nb::object forward_dynamics(const PyModel& self, const States& s, bool passive, double gravity,
                            DynamicsOptions options, nb::handle threads, Wanted wanted) {
  const Model& m = *self.model;
  const bool full = wanted == Wanted::full, with_loads = wanted != Wanted::accelerations;
  options.executor = executor_for(whole_number(threads, "threads"), s.count * m.n_bodies());
  BatchInput in = s.input();
  in.passive_acts = passive;
  in.gravity_factor = gravity;
  NewArray du(s.lead, {size(m.nv())});
  std::unique_ptr<NewArray> loads;
  if (with_loads) loads = std::make_unique<NewArray>(s.lead, Shape{size(m.n_loads()), 6});
  std::vector<double> force;
  const ForwardOutput out{du.data, loads ? loads->data : nullptr, full ? &force : nullptr};
  EvaluationReport report = without_gil([&](const GoOn& go_on) {
    return self.evaluator.forward_dynamics(s.count, in, options, out, go_on);
  });
  if (!full) {
    if (!report.ok()) throw NumericsError(failure_text(m, report));
    return with_loads ? loads->array : du.array;
  }
  ForwardResult result{du.array, loads->array, nb::none(), std::move(report)};
  if (!force.empty()) {
    NewArray f(s.lead, {force.size() / s.count});
    std::copy(force.begin(), force.end(), f.data);
    result.constraint_force = f.array;
  }
  return nb::cast(std::move(result));
}

nb::object joint_loads(const PyModel& self, nb::handle q, nb::handle v, nb::handle tau,
                       nb::handle external, nb::handle loop_tau, bool passive,
                       const std::string& method, const std::string& solver, nb::handle threads) {
  return forward_dynamics(
      self, States(*self.model, q, v, tau, "tau", external, nb::none(), loop_tau), passive, 1.0,
      options_of(method, solver, nb::none(), nb::none(), nb::none(), nb::none()), threads,
      Wanted::loads);
}

nb::list solver_list() {
  return table_rows(solver_table(), [](auto&& row, const SolverEntry& e) {
    row("name", e.name);
    row("description", e.description);
    row("kind", to_string(e.kind));
    row("takes_loops", e.takes_loops);
    row("parallel", e.parallel);
    row("reference", e.reference);
  });
}

nb::list method_list() {
  return table_rows(dynamics_table(), [](auto&& row, const DynamicsEntry& e) {
    row("name", e.name);
    row("description", e.description);
    row("reference", e.reference);
    row("uses_solver", e.uses_solver);
    row("chains_only", e.chains_only);
    row("linear_time", e.linear_time);
    row("takes_loops", e.takes_loops);
  });
}

nb::list integrator_list() {
  return table_rows(integrator_registry(), [](auto&& row, const IntegratorEntry& e) {
    row("name", e.name);
    row("description", e.description);
    row("fixed_step", e.fixed_step);
  });
}

/// What pickling keeps of a report.
using ReportState =
    std::tuple<int, std::string, std::string, std::string, int, std::string, int, double, bool>;

ReportState state_of(const EvaluationReport& r) {
  return {static_cast<int>(r.outcome),
          r.choice.method,
          r.choice.solver,
          r.choice.reason,
          r.body,
          r.body_name,
          r.iterations,
          r.error_estimate,
          r.error_is_bound};
}

EvaluationReport report_of(const ReportState& state) {
  EvaluationReport r;
  int outcome = 0;
  std::tie(outcome, r.choice.method, r.choice.solver, r.choice.reason, r.body, r.body_name,
           r.iterations, r.error_estimate, r.error_is_bound) = state;
  r.outcome = static_cast<Outcome>(outcome);
  return r;
}

using ForwardState = std::tuple<nb::object, nb::object, nb::object, ReportState>;

void bind_results(nb::module_& m) {
  bind_exception<NumericsError>(
      m, "NumericsError", PyExc_RuntimeError,
      "A computation failed: one line with the method, the body and the remedy.");
  nb::class_<EvaluationReport>(m, "Report", "How an evaluation went.")
      .def_prop_ro(
          "outcome", [](const EvaluationReport& r) { return std::string(to_string(r.outcome)); },
          "\"converged\", or what went wrong in the worst of the states.")
      .def_prop_ro(
          "method", [](const EvaluationReport& r) { return r.choice.method; },
          "The name of the method that computed it.")
      .def_prop_ro(
          "solver", [](const EvaluationReport& r) { return r.choice.solver; },
          "The name of the linear solver; empty where the method uses none.")
      .def_prop_ro(
          "reason", [](const EvaluationReport& r) { return r.choice.reason; },
          "Why this method and solver.")
      .def_ro("body", &EvaluationReport::body_name, "Where it failed, or empty.")
      .def_ro("iterations", &EvaluationReport::iterations,
              "Iterations of the linear solver; 0 of a direct one.")
      .def_ro("error_estimate", &EvaluationReport::error_estimate,
              "Error of the constraint forces in the A-norm, relative to them, as far as it is "
              "known.")
      .def_ro("error_is_bound", &EvaluationReport::error_is_bound,
              "Whether error_estimate is a bound, up to rounding, and not an estimate that may "
              "have missed a slow mode.")
      .def("__getstate__", &state_of)
      .def("__setstate__",
           [](EvaluationReport& r, const ReportState& state) {
             new (&r) EvaluationReport(report_of(state));
           })
      .def("__repr__", [](const EvaluationReport& r) {
        return "Report(" + std::string(to_string(r.outcome)) + ", method " + r.choice.method +
               (r.choice.solver.empty() ? "" : ", solver " + r.choice.solver) + ", " +
               std::to_string(r.iterations) + " iterations)";
      });
  nb::class_<ForwardResult>(m, "ForwardDynamicsResult", "What forward_dynamics(full=True) returns.")
      .def_ro("acceleration", &ForwardResult::acceleration, "dv/dt (..., nv) [rad/s2, m/s2].")
      .def_ro("joint_load", &ForwardResult::joint_load,
              "(..., n_joints + n_loops, 6) [N, N m], as of joint_loads.")
      .def_ro("constraint_force", &ForwardResult::constraint_force,
              "f (..., unknowns) [N, N m] of A f = b [sharf1993]; None of a method without it.")
      .def_ro("report", &ForwardResult::report, "How it went: a Report.")
      .def("__getstate__",
           [](const ForwardResult& r) {
             return ForwardState(r.acceleration, r.joint_load, r.constraint_force,
                                 state_of(r.report));
           })
      .def("__setstate__", [](ForwardResult& r, const ForwardState& state) {
        const auto& [acceleration, joint_load, constraint_force, report] = state;
        new (&r) ForwardResult{acceleration, joint_load, constraint_force, report_of(report)};
      });
}

void bind_forward(nb::module_& m) {
  m.def(
      "forward_dynamics",
      [](const PyModel& self, nb::handle q, nb::handle v, nb::handle tau, nb::handle external,
         bool passive, const std::string& method, const std::string& solver, nb::handle tolerance,
         nb::handle stop, nb::handle max_iterations, nb::handle solver_options, nb::handle threads,
         bool full, double gravity, nb::handle prescribed, nb::handle loop_tau,
         nb::handle loop_prescribed) {
        return forward_dynamics(
            self,
            States(*self.model, q, v, tau, "tau", external, prescribed, loop_tau, loop_prescribed),
            passive, gravity,
            options_of(method, solver, tolerance, stop, max_iterations, solver_options), threads,
            full ? Wanted::full : Wanted::accelerations);
      },
      "model"_a, "q"_a, "v"_a.none(), "tau"_a = nb::none(), nb::kw_only(),
      "external"_a = nb::none(), "passive"_a = false, "method"_a = "auto", "solver"_a = "auto",
      "tolerance"_a = nb::none(), "stop"_a = nb::none(), "max_iterations"_a = nb::none(),
      "solver_options"_a = nb::none(), "threads"_a = nb::none(), "full"_a = false,
      "gravity"_a = 1.0, "prescribed"_a = nb::none(), "loop_tau"_a = nb::none(),
      "loop_prescribed"_a = nb::none(),
      doc::text(
          "Accelerations that torques cause, by the method asked for.",
          {doc::q_v_tau, doc::external, doc::passive,
           R"(    method, solver: names as in linkwise.methods() and linkwise.solvers(), which cite their
        sources; "auto" chooses.
    tolerance, stop, max_iterations: of iterative solvers; None: as of ConstraintSystem.solve.
    solver_options: further options by name, as in linkwise.solver_options(); they go first.
    full: return everything.
)",
           doc::gravity, doc::prescribed, doc::loop_tau, doc::loop_prescribed},
          "    dv/dt (..., nv) [rad/s2, m/s2]; with full a ForwardDynamicsResult.",
          R"(a name is unknown, shapes do not fit the model, or a number is not finite.
    NumericsError: the method failed; not with full, whose report says so.)")
          .c_str());
}

void bind_loads(nb::module_& m) {
  m.def(
      "joint_loads", &joint_loads, "model"_a, "q"_a, "v"_a.none(), "tau"_a = nb::none(),
      nb::kw_only(), "external"_a = nb::none(), "loop_tau"_a = nb::none(), "passive"_a = false,
      "method"_a = "auto", "solver"_a = "auto", "threads"_a = nb::none(),
      doc::text(
          R"(Joint loads of the motion that torques cause: w_n = M_n a_n + p_n + the loads outboard
[luh1980].)",
          {doc::q_v_tau, doc::external, doc::loop_tau, doc::passive,
           "    method, solver: as of forward_dynamics.\n"},
          R"(    (..., n_joints + n_loops, 6) [N, N m]: the wrench that the inboard body exerts on the outboard
    body through the joint, drive and passive forces included, at the joint point, in the joint frame
    of the outboard body, force first. Of closed loops `indeterminacy(model, q).determinate` says which
    components rigid bodies and bearings determine; the others are one choice of many.)",
          R"(a name is unknown, shapes do not fit the model, or a number is not finite.
    NumericsError: the method failed.)")
          .c_str());
}

}  // namespace

void bind_assembly(nb::module_& m) {
  m.def(
      "assemble",
      [](const PyModel& self, nb::handle q, nb::handle v, const std::vector<std::string>& hold,
         const std::vector<std::pair<std::string, std::vector<double>>>& loop_rates) {
        const Argument q0("q0", {size(self.model->nq())}, q), v0("v0", {size(self.model->nv())}, v);
        if (!q0.given || q0.array.ndim() != 1 || !v0.given || v0.array.ndim() != 1)
          throw InputError("q0 and v0 take the coordinates and rates of one state, shapes (" +
                           std::to_string(self.model->nq()) + ",) and (" +
                           std::to_string(self.model->nv()) + ",)");
        std::vector<LoopRate> rates;
        for (const auto& [joint, own] : loop_rates) rates.push_back({joint, own});
        const Assembly found =
            linkwise::assemble(*self.model, {q0.data, q0.data + self.model->nq()},
                               {v0.data, v0.data + self.model->nv()}, hold, {}, rates);
        nb::dict out;
        out["q"] = to_numpy(found.q);
        out["v"] = to_numpy(found.v);
        out["gap"] = found.gap;
        out["released"] = nb::cast(found.released);
        return out;
      },
      "model"_a, "q0"_a, "v0"_a, "hold"_a,
      "loop_velocity"_a = std::vector<std::pair<std::string, std::vector<double>>>(),
      "The position near q0 (nq,) that closes all loops, and rates near v0 (nv,) that keep them "
      "closed; loop_velocity: those of loop joints that are given, by name: see "
      "linkwise.assemble.");
}

void bind_dynamics(nb::module_& m) {
  bind_assembly(m);
  bind_results(m);
  bind_forward(m);
  bind_loads(m);
  m.def(
      "solvers", &solver_list,
      "The table of linear solvers: dictionaries of name, description, kind, parallel, reference.");
  m.def("methods", &method_list,
        "The table of dynamics methods: dictionaries of name, description, reference, uses_solver, "
        "chains_only, linear_time, takes_loops.");
  m.def("integrators", &integrator_list,
        "The table of integrators: dictionaries of name, description, fixed_step.");
}

}  // namespace linkwise::bindings
