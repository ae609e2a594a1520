#include "linkwise/dynamics/evaluator.hpp"

#include <algorithm>
#include <atomic>

#include "linkwise/base/error.hpp"
#include "linkwise/base/finite.hpp"
#include "linkwise/base/memory.hpp"
#include "linkwise/base/named.hpp"
#include "linkwise/constraint/joint_constraint.hpp"
#include "linkwise/dynamics/composite_rigid_body.hpp"
#include "linkwise/dynamics/loop_rates.hpp"
#include "linkwise/dynamics/parts.hpp"
#include "linkwise/solve/direct/direct_solver.hpp"

namespace linkwise {
namespace {

struct CauseEntry {
  std::string_view name;
  Cause cause;
};
constexpr CauseEntry causes[] = {{"gravity", Cause::gravity}, {"velocity", Cause::velocity},
                                 {"drive", Cause::drive},     {"motion", Cause::motion},
                                 {"passive", Cause::passive}, {"external", Cause::external},
                                 {"misfit", Cause::misfit}};

void check_prescribed(const Model& m, const BatchInput& s) {
  if ((s.prescribed || s.loop_prescribed) && m.spec().prescribed.empty())
    throw InputError(std::string(s.prescribed ? "prescribed" : "loop_prescribed") +
                     ": the model has no joint of given motion; use model.prescribe([...])");
}

/// Room for the results, which are still to be written, and for torques that are not given.
void check_room(const Model& m, size_t count, const BatchInput& s, const ForwardOutput& out) {
  const bool scratch = s.passive_acts || !s.tau;
  const double numbers = (scratch ? 2.0 : 1.0) * m.nv() + (out.joint_load ? 6.0 * m.n_loads() : 0);
  if (8 * count * numbers > worth_a_check)
    require_memory(8 * count * numbers, "forward dynamics of " + std::to_string(count) + " states");
}

/// How the parts went, whatever their order in time: of the bodies at which some failed, the one
/// furthest outboard is kept.
class PartsReport {
 public:
  void add(int failed_body, bool finite) {
    for (int seen = body_; failed_body > seen && !body_.compare_exchange_weak(seen, failed_body);) {
    }
    if (!finite) finite_ = false;
  }
  void write(DynamicsReport& report) const {
    report.body = body_;
    if (body_ >= 0)
      report.outcome = Outcome::not_positive_definite;
    else if (!finite_)
      report.outcome = Outcome::not_finite;
  }

 private:
  std::atomic<int> body_{-1};
  std::atomic<bool> finite_{true};
};

/// What begins messages about state i.
std::string of_state(size_t i, size_t count) {
  return count > 1 ? "state " + std::to_string(i) + ": " : "";
}

/// `rows` rows of results from `first` on; absent ones are finite.
bool rows_finite(const double* results, size_t first, size_t rows, size_t width) {
  return !results || all_finite({results + first * width, rows * width});
}

/// Every state by one method, one after the other. Of a single one nobody is asked: reading the
/// clock would take a tenth of its time.
void one_by_one(const Model& m, DynamicsMethod& method, size_t count, AppliedStates& states,
                const ForwardOutput& out, DynamicsReport& report, const GoOn& go_on) {
  const size_t load_width = 6 * static_cast<size_t>(m.n_loads());
  const auto finite = [&](size_t i) {
    return rows_finite(out.acceleration, i, 1, m.nv()) &&
           rows_finite(out.joint_load, i, 1, load_width);
  };
  for (size_t i = 0; i < count && (count == 1 || go_on()); ++i) {
    const DynamicsReport r = method.evaluate(
        0, states.for_method(i, method.finds_loops()), out.acceleration + i * m.nv(),
        out.joint_load ? out.joint_load + i * load_width : nullptr);
    report.loops = r.loops;
    report.iterations = std::max(report.iterations, r.iterations);
    report.error_estimate = std::max(report.error_estimate, r.error_estimate);
    report.error_is_bound = r.error_is_bound && (i == 0 || report.error_is_bound);
    if (report.ok() && r.ok() && !finite(i)) report.outcome = Outcome::not_finite;
    if (!r.ok()) {
      report.outcome = r.outcome;
      if (r.body >= 0) report.body = r.body;
    }
    if (out.constraint_force)
      out.constraint_force->insert(out.constraint_force->end(), method.constraint_force().begin(),
                                   method.constraint_force().end());
  }
}

/// Loads of each cause alone where loops close, state after state: the same method, given nothing
/// but the cause. All choices that it makes, such as which dependent constraints carry a load,
/// depend on the position alone, so the shares of all causes add up.
void each_cause_alone(const Model& m, DynamicsMethod& method, size_t count,
                      const BatchInput& states, std::span<const Cause> asked, double* loads,
                      DynamicsReport& report, const GoOn& go_on) {
  BatchInput driven = states, passive = states;
  passive.tau = passive.loop_tau = nullptr;
  passive.passive_acts = std::find(asked.begin(), asked.end(), Cause::passive) != asked.end();
  AppliedStates driven_states(m, count, driven), passive_states(m, count, passive);
  const size_t width = 6 * static_cast<size_t>(m.n_loads());
  const std::vector<double> none(m.nv());
  std::vector<double> du(m.nv());
  for (size_t i = 0; i < count && go_on(); ++i) {
    const SweepInput<double> all = driven_states[i], yielding = passive_states[i];
    for (const Cause cause : asked) {
      SweepInput<double> in;
      in.q = all.q;
      in.v = cause == Cause::velocity ? all.v : none.data();
      in.tau = cause == Cause::drive     ? all.tau
               : cause == Cause::passive ? yielding.tau
                                         : none.data();
      if (cause == Cause::drive) in.loop_tau = all.loop_tau;
      if (cause == Cause::passive) in.loop_tau = yielding.loop_tau;
      if (cause == Cause::motion) in.prescribed = all.prescribed;
      if (cause == Cause::motion) in.loop_du = all.loop_du;
      if (cause == Cause::external) in.external = all.external;
      in.gravity_factor = cause == Cause::gravity ? all.gravity_factor : 0;
      in.misfit_factor = cause == Cause::misfit ? 1 : 0;
      const DynamicsReport r = method.evaluate(0, in, du.data(), loads);
      if (report.ok() && !r.ok()) report = r;
      if (report.ok() && !rows_finite(loads, 0, 1, width)) report.outcome = Outcome::not_finite;
      loads += width;
    }
  }
}

/// What parts of the states report, in their order, as one_by_one() does of them all.
void add_part(DynamicsReport& report, const DynamicsReport& part) {
  report.loops = part.loops;
  if (part.ok() || (part.outcome == Outcome::not_finite && !report.ok())) return;
  report.outcome = part.outcome;
  if (part.body >= 0) report.body = part.body;
}

ForwardOutput from_state(const Model& m, const ForwardOutput& out, size_t first) {
  return {out.acceleration + first * m.nv(),
          out.joint_load ? out.joint_load + first * 6 * m.n_loads() : nullptr, nullptr};
}

}  // namespace

DynamicsOptions evaluation_options() {
  DynamicsOptions options;
  options.solver_options.tolerance = 1e-12;
  return options;
}

EvaluationReport evaluation_report(const Model& model, Choice choice,
                                   const DynamicsReport& report) {
  return {report, std::move(choice), report.body < 0 ? "" : model.body_name(report.body)};
}

std::string remedy_at(const Model& model, Outcome outcome, int body) {
  if (outcome == Outcome::not_positive_definite && body >= 0)
    if (std::string axes = model.lined_up(body); !axes.empty()) return axes;
  return std::string(remedy(outcome));
}

void require_determined(const Model& model) {
  if (!model.undetermined().empty()) throw InputError(model.undetermined());
}

std::string failure_text(const Model& model, const EvaluationReport& report) {
  const Choice& by = report.choice;
  return "method " + by.method + (by.solver.empty() ? "" : " with solver " + by.solver) + ": " +
         std::string(message(report.outcome)) +
         (report.body < 0 ? "" : " at body '" + report.body_name + "'" + model.where()) + "; " +
         remedy_at(model, report.outcome, report.body);
}

std::vector<Cause> causes_from_names(std::span<const std::string> names) {
  std::vector<Cause> found;
  for (const std::string& name : names) found.push_back(find_named("cause", name, causes).cause);
  return found;
}

/// What one call needs beside its arguments; kept, so that the next one allocates nothing.
struct Evaluator::Workspace {
  explicit Workspace(const Model& m) : model(m), batch(m) {}

  /// What "auto" stands for with all options left alone, and why.
  const Choice& default_choice() {
    if (choice.method.empty()) choice = choose_dynamics(model, {});
    return choice;
  }
  /// Made anew only where other options are asked for than at the last call.
  DynamicsMethod& kept_method(const DynamicsOptions& asked) {
    if (!method || method_options != asked) {
      method = make_dynamics(model, asked);
      method_options = asked;
    }
    return *method;
  }

  const Model& model;
  BatchEvaluator batch;
  std::unique_ptr<CompositeRigidBody> composite;
  std::unique_ptr<LoopRates> loops;
  std::unique_ptr<DynamicsMethod> method;
  DynamicsOptions method_options;
  Choice choice;
};

/// Borrows a workspace and gives it back at the end of its life.
class Evaluator::Lease {
 public:
  explicit Lease(const Evaluator& owner) : owner_(owner) {
    for (std::atomic<Workspace*>& place : owner.idle_)
      if (place.load(std::memory_order_relaxed))
        if (workspace_.reset(place.exchange(nullptr, std::memory_order_acquire)); workspace_)
          return;
    workspace_ = std::make_unique<Workspace>(*owner.model_);
  }
  ~Lease() {
    for (std::atomic<Workspace*>& place : owner_.idle_) {
      Workspace* none = nullptr;
      if (place.compare_exchange_strong(none, workspace_.get(), std::memory_order_release,
                                        std::memory_order_relaxed)) {
        workspace_.release();
        return;
      }
    }
  }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;
  Workspace& operator*() { return *workspace_; }
  Workspace* operator->() { return workspace_.get(); }

 private:
  const Evaluator& owner_;
  std::unique_ptr<Workspace> workspace_;
};

Evaluator::Evaluator(const Model& model) : model_(&model) {}
Evaluator::~Evaluator() {
  for (std::atomic<Workspace*>& place : idle_) delete place.load();
}

/// What computes the states: a method, one state after the other, or a kernel on lanes.
struct Evaluator::Pick {
  DynamicsMethod* method = nullptr;
  BatchMethod on_lanes = BatchMethod::articulated_body;
  std::unique_ptr<DynamicsMethod> own;  ///< of this call alone
};

Evaluator::Pick Evaluator::pick(Workspace& workspace, size_t count, const DynamicsOptions& options,
                                bool forces, Choice& choice) const {
  Pick picked;
  const bool is_auto = options.method == "auto", by_state = count == 1 || model_->is_constrained();
  // This path builds no text: that would take as long as the dynamics of a small machine.
  if ((is_auto || options.method == "articulated_body") && options.solver == "auto") {
    const Choice& by_default = workspace.default_choice();
    choice.method = by_state && is_auto ? by_default.method : "articulated_body";
    if (by_state && is_auto) choice.solver = by_default.solver;
    if (by_state)
      picked.method = &workspace.kept_method(options);
    else if (options.initial_guess != "zero")
      choose_dynamics(*model_, options);  // refuses unknown names
    if (forces)
      choice.reason = !is_auto                             ? "as asked for"
                      : choice.method == by_default.method ? by_default.reason
                                                           : "many states, side by side in lanes";
    return picked;
  }
  choice = choose_dynamics(*model_, options);
  const auto on_lanes = find_dynamics(choice.method).on_lanes;
  if (!by_state && !forces && on_lanes && choice.solver == "thomas" &&
      !ask_for_refinement(options.solver_options)) {
    require_regular_inertias(*model_);
    picked.on_lanes = *on_lanes;
  } else {
    picked.own = make_dynamics(*model_, options);
    picked.method = picked.own.get();
  }
  return picked;
}

/// States of machines with loops share no lanes, but threads.
DynamicsReport Evaluator::over_threads(size_t count, const BatchInput& states,
                                       const DynamicsOptions& options, const ForwardOutput& out,
                                       const GoOn& go_on) const {
  const Model& m = *model_;
  struct Part {
    DynamicsReport report;
    std::string wrong;
  };
  std::vector<Part> parts(count);  // each at its first state
  for_each_part(m, count, options.executor, go_on, [&](size_t first, size_t n) {
    try {
      Lease own(*this);
      AppliedStates applied(m, n, states.from(m, first), first);
      one_by_one(m, own->kept_method(options), n, applied, from_state(m, out, first),
                 parts[first].report, go_on);
    } catch (const InputError& error) {
      parts[first].wrong = error.what();
    }
  });
  DynamicsReport report;
  for (const Part& part : parts) {
    if (!part.wrong.empty()) throw InputError(part.wrong);
    add_part(report, part.report);
  }
  return report;
}

EvaluationReport Evaluator::forward_dynamics(size_t count, const BatchInput& states,
                                             const DynamicsOptions& options,
                                             const ForwardOutput& out, const GoOn& go_on) const {
  const Model& m = *model_;
  check_prescribed(m, states);
  require_determined(m);
  check_room(m, count, states, out);
  if (count > 1 && m.is_constrained() && !out.constraint_force) {
    check_states(m, count, states);
    return evaluation_report(m, choose_dynamics(m, options),
                             over_threads(count, states, options, out, go_on));
  }
  AppliedStates applied(m, count, states);
  const BatchInput& s = applied.rows();
  DynamicsReport report;
  Choice choice;
  Lease workspace(*this);
  const Pick picked = pick(*workspace, count, options, out.constraint_force != nullptr, choice);
  if (picked.method) {
    one_by_one(m, *picked.method, count, applied, out, report, go_on);
    return evaluation_report(m, std::move(choice), report);
  }
  PartsReport parts;
  const auto part = [&](BatchEvaluator& batch, size_t first, size_t n) {
    const int failed = batch.forward_dynamics(
        n, s.from(m, first), out.acceleration + first * m.nv(),
        out.joint_load ? out.joint_load + first * 6 * m.n_joints() : nullptr, picked.on_lanes);
    parts.add(failed, rows_finite(out.acceleration, first, n, m.nv()) &&
                          rows_finite(out.joint_load, first, n, 6 * m.n_joints()));
  };
  for_each_part(m, count, options.executor, go_on, [&](size_t first, size_t n) {
    if (n == count) return part(workspace->batch, first, n);
    Lease own(*this);
    part(own->batch, first, n);
  });
  parts.write(report);
  return evaluation_report(m, std::move(choice), report);
}

EvaluationReport Evaluator::loads_by_cause(size_t count, const BatchInput& states,
                                           std::span<const Cause> causes, const std::string& method,
                                           const Executor& executor, double* loads,
                                           const GoOn& go_on) const {
  const Model& m = *model_;
  check_states(m, count, states);
  check_prescribed(m, states);
  require_determined(m);
  if (method != "articulated_body" && method != "constraint_force")
    throw InputError("method '" + method +
                     "' does not split loads; use articulated_body or constraint_force");
  const DynamicsEntry& by = find_dynamics(method);
  require_known_bodies(m, by);
  if (m.is_constrained()) {
    DynamicsOptions options;
    options.method = method;
    DynamicsReport report;
    Lease workspace(*this);
    each_cause_alone(m, workspace->kept_method(options), count, states, causes, loads, report,
                     go_on);
    return evaluation_report(m, {method, "", ""}, report);
  }
  if (by.uses_solver) require_regular_inertias(m);
  BatchInput s = states;
  std::vector<double> passive;
  if (std::find(causes.begin(), causes.end(), Cause::passive) != causes.end()) {
    passive = with_passive_forces(m, count, states, nullptr);
    s.passive = passive.data();
  }
  const size_t width = causes.size() * 6 * m.n_joints();
  PartsReport parts;
  for_each_part(m, count, executor, go_on, [&](size_t first, size_t n) {
    Lease workspace(*this);
    const int failed = workspace->batch.loads_by_cause(n, s.from(m, first), causes,
                                                       loads + first * width, *by.on_lanes);
    parts.add(failed, rows_finite(loads, first, n, width));
  });
  DynamicsReport report;
  parts.write(report);
  return evaluation_report(m, {method, "", ""}, report);
}

EvaluationReport Evaluator::inverse_dynamics(size_t count, const BatchInput& states,
                                             std::span<const std::string> driven,
                                             const Executor& executor, const InverseOutput& out,
                                             const GoOn& go_on) const {
  const Model& m = *model_;
  DynamicsReport report;
  if (m.is_constrained() || !driven.empty()) {
    driven_inverse(count, states, driven, out, report, go_on);
    return evaluation_report(m, {"articulated_body", "", ""}, report);
  }
  check_states(m, count, states);
  for_each_part(m, count, executor, go_on, [&](size_t first, size_t n) {
    Lease workspace(*this);
    workspace->batch.inverse_dynamics(n, states.from(m, first),
                                      out.tau ? out.tau + first * m.nv() : nullptr,
                                      out.loads ? out.loads + first * 6 * m.n_joints() : nullptr);
  });
  if (out.tau && states.passive_acts && m.has_passive_forces()) {
    const std::vector<double> passive = with_passive_forces(m, count, states, nullptr);
    for (size_t i = 0; i < passive.size(); ++i) out.tau[i] -= passive[i];
  }
  return evaluation_report(m, {}, report);
}

void Evaluator::driven_inverse(size_t count, const BatchInput& states,
                               std::span<const std::string> driven, const InverseOutput& out,
                               DynamicsReport& report, const GoOn& go_on) const {
  const Model& m = *model_;
  require_determined(m);
  DrivenInverse kernel(m, driven);
  BatchInput acting = states;
  acting.tau = nullptr;
  AppliedStates applied(m, count, acting);
  const std::vector<double> rest(m.nv());
  const auto row = [](double* x, size_t i, size_t n) { return x ? x + i * n : nullptr; };
  const size_t nv = m.nv();
  for (size_t i = 0; i < count && report.ok() && go_on(); ++i)
    report = kernel.evaluate(applied[i], states.du ? states.du + i * nv : rest.data(),
                             of_state(i, count),
                             {row(out.tau, i, nv), row(out.loop_tau, i, m.loops.nv),
                              row(out.loads, i, 6 * static_cast<size_t>(m.n_loads()))});
}

EvaluationReport Evaluator::reduce(size_t count, const double* q, DrivenInverse& driven, double* M,
                                   double* N, const GoOn& go_on) const {
  const Model& m = *model_;
  require_determined(m);
  BatchInput states;
  states.q = q;
  AppliedStates applied(m, count, states);
  const size_t n = driven.n_driven();
  DynamicsReport report;
  for (size_t i = 0; i < count && report.ok() && go_on(); ++i)
    report = driven.reduce(applied[i].q, of_state(i, count), M ? M + i * n * n : nullptr,
                           N ? N + i * n * m.nv() : nullptr);
  return evaluation_report(m, {"articulated_body", "", ""}, report);
}

/// Of a machine with elastic links: a column is what one acceleration takes, at rest and without
/// gravity.
void mass_matrix_by_columns(const Model& m, const double* q, double* H) {
  InverseDynamics<double> dynamics(m);
  SweepInput<double> in;
  in.q = q;
  in.gravity_factor = 0;
  std::vector<double> du(m.nv(), 0.0), tau(m.nv());
  for (int k = 0; k < m.nv(); ++k) {
    du[k] = 1;
    dynamics.evaluate(in, du.data(), tau.data(), nullptr);
    for (int i = 0; i < m.nv(); ++i) H[i * m.nv() + k] = tau[i];
    du[k] = 0;
  }
}

void Evaluator::mass_matrix(size_t count, const double* q, const Executor& executor, double* H,
                            const GoOn& go_on) const {
  const Model& m = *model_;
  const size_t nv = m.nv();
  if (!m.own_element.empty()) {
    return for_each_part(m, count, executor, go_on, [&](size_t first, size_t n) {
      LoopRates loops(m);
      for (size_t i = first; i < first + n; ++i) {
        mass_matrix_by_columns(m, q + i * m.nq(), H + i * nv * nv);
        loops.add_rotors_to(q + i * m.nq(), H + i * nv * nv);
      }
    });
  }
  require_known_bodies(m, find_dynamics("composite_rigid_body"));
  for_each_part(m, count, executor, go_on, [&](size_t first, size_t n) {
    Lease workspace(*this);
    if (!workspace->composite) {
      workspace->composite = std::make_unique<CompositeRigidBody>(m);
      workspace->loops = std::make_unique<LoopRates>(m);
    }
    for (size_t i = first; i < first + n; ++i) {
      workspace->composite->mass_matrix(q + i * m.nq(), H + i * nv * nv);
      workspace->loops->add_rotors_to(q + i * m.nq(), H + i * nv * nv);
    }
  });
}

}  // namespace linkwise
