#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "linkwise/exec/thread_pool.hpp"
#include "linkwise/forces/passive.hpp"
#include "linkwise/integrate/integrator.hpp"
#include "linkwise/solve/registry.hpp"
#include "py_model.hpp"
#include "report.hpp"
#include "solver_options.hpp"

namespace linkwise::bindings {
namespace {

struct ForwardResult {
  nb::object acceleration, joint_load, constraint_force, report;
};

size_t size(int n) { return static_cast<size_t>(n); }

/// q, v, tau and external wrenches with their leading axes broadcast.
struct States {
  Argument q, v, tau, external, prescribed;
  Shape lead;
  size_t count;
  std::vector<double> tau_zero;

  States(const Model& m, nb::handle q_, nb::handle v_, nb::handle tau_, const char* tau_name,
         nb::handle external_, nb::handle prescribed_ = nb::none())
      : q("q", {size(m.nq())}, q_),
        v("v", {size(m.nv())}, v_),
        tau(tau_name, {size(m.nv())}, tau_),
        external("external", {size(m.n_joints()), 6}, external_),
        prescribed("prescribed", {size(m.nv())}, prescribed_) {
    if (!q.given)
      throw InputError("q is missing; give an array of shape (..., " + std::to_string(m.nq()) +
                       ")");
    lead = broadcast_leading({&q, &v, &tau, &external, &prescribed});
    count = product(lead);
  }
};

void check_external(const Model& m, const States& s) {
  if (!s.external.given) return;
  for (int j = 0; j < m.n_joints(); ++j) {
    if (m.joints[j].last_of_body) continue;
    for (size_t i = 0; i < s.count; ++i)
      for (int k = 0; k < 6; ++k)
        if (s.external.data[(i * m.n_joints() + j) * 6 + k] != 0)
          throw InputError(
              "body '" + m.links[m.joints[j].link].name + "'" + m.where() +
              " has no mass, so no wrench can act on it; apply it to the next body outboard");
  }
}

/// tau with the model's passive forces added, one row a system.
std::vector<double> with_passive(const Model& m, const States& s) {
  std::vector<double> tau(s.count * m.nv());
  std::vector<double> rest(m.nv());
  for (size_t i = 0; i < s.count; ++i) {
    double* row = tau.data() + i * m.nv();
    if (s.tau.given) std::copy(s.tau.data + i * m.nv(), s.tau.data + (i + 1) * m.nv(), row);
    add_passive_forces(m, s.q.data + i * m.nq(), s.v.given ? s.v.data + i * m.nv() : rest.data(),
                       row);
  }
  return tau;
}

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

/// Runs the chosen method on every system; force is [count][unknowns] when wanted.
Outcome run_method(const Model& m, DynamicsMethod& method, const States& s, const double* tau,
                   double gravity, double* du, double* loads, std::vector<double>* force,
                   PyReport& report) {
  Outcome worst = Outcome::converged;
  std::vector<double> zero(m.nv());
  for (size_t i = 0; i < s.count; ++i) {
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

/// Runs f(batch, input, first, count) on parts of a batch that end at whole lane groups, so that
/// the grouping, and with it every bit, is that of one thread. Returns the largest result.
template <class F>
int over_threads(const PyModel& self, Scratch& own, size_t count, const BatchInput& in, int threads,
                 F&& f) {
  const Model& m = *self.model;
  constexpr size_t worth_a_thread = 512;  // bodies: some 20 us of work
  const size_t groups = (count + native_lanes - 1) / native_lanes;
  const size_t work = count * m.n_bodies() / worth_a_thread + 1;
  const int parts = static_cast<int>(std::min({static_cast<size_t>(threads), groups, work}));
  if (parts <= 1) return f(own.batch, in, 0, count);
  std::vector<int> results(parts);
  parallel_for(parts, parts, [&](int i) {
    const size_t first = groups * i / parts * native_lanes;
    const size_t last = std::min(count, groups * (i + 1) / parts * native_lanes);
    const auto from = [&](const double* rows, size_t width) {
      return rows ? rows + first * width : nullptr;
    };
    BatchInput part = in;
    part.q = from(in.q, m.nq());
    part.v = from(in.v, m.nv());
    part.tau = from(in.tau, m.nv());
    part.du = from(in.du, m.nv());
    part.external = from(in.external, 6 * m.n_joints());
    PyModel::Lease scratch(self);
    results[i] = f(scratch->batch, part, first, last - first);
  });
  return *std::max_element(results.begin(), results.end());
}

nb::object forward_dynamics(const PyModel& self, nb::handle q, nb::handle v, nb::handle tau,
                            nb::handle external, bool passive, const std::string& method,
                            const std::string& solver, double tolerance, const std::string& stop,
                            int max_iterations, nb::handle solver_options, nb::handle threads,
                            bool full, double gravity, nb::handle prescribed) {
  const Model& m = *self.model;
  States s(m, q, v, tau, "tau", external, prescribed);
  check_external(m, s);
  check_gravity(gravity);
  if (s.prescribed.given && m.spec().prescribed.empty())
    throw InputError(
        "prescribed: the model has no joint of given motion; use model.prescribe([...])");
  const ForwardOptions asked{method, solver, stop, tolerance, max_iterations, solver_options};
  const bool plain = (method == "auto" || method == "articulated_body") && solver == "auto";
  const int team = threads_of(threads, s.count * m.n_bodies());
  PyReport report;
  std::unique_ptr<DynamicsMethod> own;
  DynamicsMethod* other = nullptr;
  PyModel::Lease scratch(self);
  if (method == "auto" && plain && s.count == 1 && scratch->piecewise_suits()) {
    other = &scratch->piecewise(team);
    report.method = "piecewise";
    report.solver = "thomas";
    if (full) report.reason = choose_dynamics(m, dynamics_options(asked)).reason;
  } else if (plain) {
    report.method = "articulated_body";
    if (full || !solver_options.is_none())
      report.reason = choose_dynamics(m, dynamics_options(asked)).reason;
  } else {
    DynamicsOptions options = dynamics_options(asked);
    options.threads = team;
    const Choice choice = choose_dynamics(m, options);
    report.method = choice.method;
    report.solver = choice.solver;
    report.reason = choice.reason;
    own = make_dynamics(m, options);
    other = own.get();
  }
  NewArray du(s.lead, {size(m.nv())});
  std::unique_ptr<NewArray> loads;
  if (full) loads = std::make_unique<NewArray>(s.lead, Shape{size(m.n_joints()), 6});
  std::vector<double> passive_tau, force;
  Outcome outcome = Outcome::converged;
  {
    const nb::gil_scoped_release release;
    const double* total = s.tau.given ? s.tau.data : nullptr;
    if (passive || !total) {
      if (passive && m.has_passive_forces())
        passive_tau = with_passive(m, s);
      else if (!total)
        passive_tau.assign(s.count * m.nv(), 0.0);
      if (!passive_tau.empty()) total = passive_tau.data();
    }
    if (other) {
      outcome = run_method(m, *other, s, total, gravity, du.data, loads ? loads->data : nullptr,
                           full ? &force : nullptr, report);
    } else {
      BatchInput in;
      in.q = s.q.data;
      in.v = s.v.given ? s.v.data : nullptr;
      in.tau = total;
      in.external = s.external.given ? s.external.data : nullptr;
      in.du = s.prescribed.given ? s.prescribed.data : nullptr;
      in.gravity_factor = gravity;
      const int body = over_threads(
          self, *scratch, s.count, in, team,
          [&](BatchEvaluator& batch, const BatchInput& part, size_t first, size_t count) {
            return batch.forward_dynamics(count, part, du.data + first * m.nv(),
                                          loads ? loads->data + first * 6 * m.n_joints() : nullptr);
          });
      if (body >= 0) {
        outcome = Outcome::not_positive_definite;
        report.body = m.body_name(body);
      }
    }
  }
  report.outcome = to_string(outcome);
  if (!full) {
    if (outcome != Outcome::converged) throw NumericsError(failure_text(m, report, outcome));
    return nb::cast(du.array);
  }
  ForwardResult result;
  result.acceleration = nb::cast(du.array);
  result.joint_load = nb::cast(loads->array);
  result.constraint_force = nb::none();
  if (other && !other->constraint_force().empty()) {
    NewArray f(s.lead, {other->constraint_force().size()});
    std::copy(force.begin(), force.end(), f.data);
    result.constraint_force = nb::cast(f.array);
  }
  result.report = nb::cast(report);
  return nb::cast(result);
}

nb::object inverse_dynamics(const PyModel& self, nb::handle q, nb::handle v, nb::handle a,
                            nb::handle external, double gravity, bool loads) {
  const Model& m = *self.model;
  States s(m, q, v, a, "acceleration", external);
  check_external(m, s);
  check_gravity(gravity);
  NewArray out(s.lead, loads ? Shape{size(m.n_joints()), 6} : Shape{size(m.nv())});
  PyModel::Lease scratch(self);
  const int team_size = threads_of(nb::none(), s.count * m.n_bodies());
  const nb::gil_scoped_release release;
  BatchInput in;
  in.q = s.q.data;
  in.v = s.v.given ? s.v.data : nullptr;
  in.du = s.tau.given ? s.tau.data : nullptr;
  in.external = s.external.given ? s.external.data : nullptr;
  in.gravity_factor = gravity;
  const size_t width = loads ? 6 * m.n_joints() : m.nv();
  over_threads(self, *scratch, s.count, in, team_size,
               [&](BatchEvaluator& batch, const BatchInput& part, size_t first, size_t count) {
                 double* rows = out.data + first * width;
                 batch.inverse_dynamics(count, part, loads ? nullptr : rows,
                                        loads ? rows : nullptr);
                 return 0;
               });
  const nb::gil_scoped_acquire acquire;
  return nb::cast(out.array);
}

nb::object joint_loads(const PyModel& self, nb::handle q, nb::handle v, nb::handle tau,
                       nb::handle external, bool passive, const std::string& method,
                       const std::string& solver) {
  const nb::object result =
      forward_dynamics(self, q, v, tau, external, passive, method, solver, 1e-12, "energy_norm", 0,
                       nb::none(), nb::none(), true, 1.0, nb::none());
  const PyReport& report = nb::cast<PyReport&>(nb::cast<ForwardResult&>(result).report);
  if (report.outcome != "converged")
    throw NumericsError("method " + report.method + ": " + report.outcome +
                        (report.body.empty() ? "" : " at body '" + report.body + "'"));
  return nb::cast<ForwardResult&>(result).joint_load;
}

nb::object mass_matrix(const PyModel& self, nb::handle q) {
  const Model& m = *self.model;
  States s(m, q, nb::none(), nb::none(), "tau", nb::none());
  NewArray H(s.lead, {size(m.nv()), size(m.nv())});
  PyModel::Lease scratch(self);
  if (!scratch->composite) scratch->composite = std::make_unique<CompositeRigidBody>(m);
  for (size_t i = 0; i < s.count; ++i)
    scratch->composite->mass_matrix(s.q.data + i * m.nq(), H.data + i * m.nv() * m.nv());
  return nb::cast(H.array);
}

/// f(q, v, out) for every state; out has `tail` numbers.
template <class F>
nb::object map_states(const PyModel& self, nb::handle q, nb::handle v, const Shape& tail, F&& f) {
  const Model& m = *self.model;
  States s(m, q, v, nb::none(), "tau", nb::none());
  NewArray out(s.lead, tail);
  const size_t n = product(tail);
  std::vector<double> zero(m.nv());
  for (size_t i = 0; i < s.count; ++i)
    f(m, s.q.data + i * m.nq(), s.v.given ? s.v.data + i * m.nv() : zero.data(), out.data + i * n);
  return s.lead.empty() && tail.empty() ? nb::object(nb::float_(out.data[0])) : nb::cast(out.array);
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
      "forward_dynamics", &forward_dynamics, "model"_a, "q"_a, "v"_a.none(), "tau"_a = nb::none(),
      nb::kw_only(), "external"_a = nb::none(), "passive"_a = false, "method"_a = "auto",
      "solver"_a = "auto", "tolerance"_a = 1e-12, "stop"_a = "energy_norm", "max_iterations"_a = 0,
      "solver_options"_a = nb::none(), "threads"_a = nb::none(), "full"_a = false,
      "gravity"_a = 1.0, "prescribed"_a = nb::none(),
      "Accelerations dv/dt (..., nv) [rad/s2, m/s2] of q (..., nq), v (..., nv), tau (..., nv); "
      "leading axes broadcast.\n\n"
      "external (..., n_bodies, 6): wrench [N, N m] on each body at its joint frame's origin, in "
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
         double gravity) { return inverse_dynamics(self, q, v, a, external, gravity, false); },
      "model"_a, "q"_a, "v"_a.none(), "acceleration"_a.none(), nb::kw_only(),
      "external"_a = nb::none(), "gravity"_a = 1.0,
      "tau (..., nv) [N m, N] that gives the acceleration (..., nv) at q, v: Newton-Euler "
      "recursion, armature included.");
  m.def(
      "inverse_dynamics_loads",
      [](const PyModel& self, nb::handle q, nb::handle v, nb::handle a, nb::handle external,
         double gravity) { return inverse_dynamics(self, q, v, a, external, gravity, true); },
      "model"_a, "q"_a, "v"_a.none(), "acceleration"_a.none(), nb::kw_only(),
      "external"_a = nb::none(), "gravity"_a = 1.0,
      "Joint loads (..., n_joints, 6) of a given motion, frames and signs as in joint_loads; "
      "gravity "
      "multiplies the\n"
      "model's gravity.");
  m.def("joint_loads", &joint_loads, "model"_a, "q"_a, "v"_a.none(), "tau"_a = nb::none(),
        nb::kw_only(), "external"_a = nb::none(), "passive"_a = false, "method"_a = "auto",
        "solver"_a = "auto",
        "Joint loads (..., n_joints, 6) [N, N m] of the motion that tau causes: the wrench that "
        "the inboard body exerts on\n"
        "the outboard body through the joint, at the joint point, in the joint's outboard frame, "
        "force first.");
  m.def("mass_matrix", &mass_matrix, "model"_a, "q"_a,
        "Joint-space mass matrix (..., nv, nv), armature included.");
  m.def(
      "passive_torque",
      [](const PyModel& self, nb::handle q, nb::handle v) {
        return map_states(self, q, v, {size(self.model->nv())},
                          [](const Model& m, const double* q, const double* v, double* out) {
                            std::fill(out, out + m.nv(), 0.0);
                            add_passive_forces(m, q, v, out);
                          });
      },
      "model"_a, "q"_a, "v"_a,
      "Torque (..., nv) [N m, N] of the joints' own damping, friction, springs and stops.");
  m.def(
      "kinetic_energy",
      [](const PyModel& self, nb::handle q, nb::handle v) {
        return map_states(self, q, v, {},
                          [](const Model& m, const double* q, const double* v, double* out) {
                            *out = kinetic_energy(m, q, v);
                          });
      },
      "model"_a, "q"_a, "v"_a, "Kinetic energy (...) [J], rotors (armature) included.");
  m.def(
      "potential_energy",
      [](const PyModel& self, nb::handle q) {
        return map_states(self, q, nb::none(), {},
                          [](const Model& m, const double* q, const double*, double* out) {
                            *out = potential_energy(m, q);
                          });
      },
      "model"_a, "q"_a,
      "Potential energy (...) [J] of gravity (zero at the world origin), springs and stops.");
  m.def(
      "momentum",
      [](const PyModel& self, nb::handle q, nb::handle v) {
        return map_states(self, q, v, {6},
                          [](const Model& m, const double* q, const double* v, double* out) {
                            momentum(m, q, v, out);
                          });
      },
      "model"_a, "q"_a, "v"_a,
      "Linear [kg m/s] and angular [kg m2/s] momentum (..., 6) about the world origin, world "
      "axes.");
  m.def(
      "body_poses",
      [](const PyModel& self, nb::handle q) {
        return map_states(self, q, nb::none(), {size(self.model->n_joints()), 4, 4},
                          [](const Model& m, const double* q, const double*, double* out) {
                            body_poses(m, q, out);
                          });
      },
      "model"_a, "q"_a,
      "Poses (..., n_bodies, 4, 4) of the bodies' frames (their joints' outboard frames) in the "
      "world.");
  m.def(
      "link_poses",
      [](const PyModel& self, nb::handle q) {
        return map_states(self, q, nb::none(), {self.model->links.size(), 4, 4},
                          [](const Model& m, const double* q, const double*, double* out) {
                            link_poses(m, q, out);
                          });
      },
      "model"_a, "q"_a,
      "Poses (..., links, 4, 4) of all links of the source, merged ones too, in the world.");
  m.def(
      "body_jacobian",
      [](const PyModel& self, nb::handle q, nb::handle body) {
        int joint = -1;
        if (nb::isinstance<nb::str>(body)) {
          const LinkInfo& link =
              self.model->links[self.model->link_index(nb::cast<std::string>(body))];
          joint = link.joint;
          if (joint < 0 || self.model->links[self.model->joints[joint].link].name != link.name)
            throw InputError("link '" + link.name +
                             "' is welded and has no frame of its own; name the body that carries "
                             "it (Model.notes)");
        } else {
          joint = nb::cast<int>(body);
          if (joint < 0 || joint >= self.model->n_joints())
            throw InputError("body index " + std::to_string(joint) +
                             " is out of range; the model has " +
                             std::to_string(self.model->n_joints()) + " bodies");
        }
        return map_states(self, q, nb::none(), {6, size(self.model->nv())},
                          [joint](const Model& m, const double* q, const double*, double* out) {
                            body_jacobian(m, q, joint, out);
                          });
      },
      "model"_a, "q"_a, "body"_a,
      "Jacobian (..., 6, nv) of a body's frame in its own axes, linear first; body: name or "
      "index.");
  m.def("solvers", &solver_list, "The table of linear solvers, as dictionaries.");
  m.def("methods", &method_list, "The table of dynamics methods, as dictionaries.");
  m.def("integrators", &integrator_list, "The table of integrators, as dictionaries.");
}

}  // namespace linkwise::bindings
