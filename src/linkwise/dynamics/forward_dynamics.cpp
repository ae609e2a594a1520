#include "linkwise/dynamics/forward_dynamics.hpp"

#include <iomanip>
#include <sstream>

#include "linkwise/base/error.hpp"
#include "linkwise/base/named.hpp"
#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/dynamics/articulated_paths.hpp"
#include "linkwise/dynamics/composite_rigid_body.hpp"
#include "linkwise/dynamics/constraint_elimination.hpp"
#include "linkwise/dynamics/constraint_force.hpp"
#include "linkwise/dynamics/global_projection.hpp"
#include "linkwise/dynamics/joint_space_conjugate_gradient.hpp"
#include "linkwise/dynamics/loop_work.hpp"
#include "linkwise/dynamics/looped_constraint_force.hpp"
#include "linkwise/dynamics/piecewise.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/solve/direct/direct_solver.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise {
namespace {

/// Of a kernel, which succeeds, or fails at a body.
template <class Kernel>
DynamicsReport report_of(const Kernel& kernel, bool succeeded) {
  DynamicsReport report;
  if (succeeded) return report;
  report.outcome = Outcome::not_positive_definite;
  report.body = kernel.failed_body();
  return report;
}

/// Methods without unknowns of their own.
template <class Kernel>
class Recursion : public DynamicsMethod {
 public:
  template <class... Options>
  explicit Recursion(const Model& model, Options... options) : kernel_(model, options...) {}
  DynamicsReport evaluate(double, const SweepInput<double>& in, double* du,
                          double* loads) override {
    return report_of(kernel_, kernel_.evaluate(in, du, loads));
  }

  Kernel& kernel() { return kernel_; }

 private:
  Kernel kernel_;
};

template <class Kernel>
std::unique_ptr<DynamicsMethod> make_recursion(const Model& model, const DynamicsOptions&) {
  return std::make_unique<Recursion<Kernel>>(model);
}

template <class Method>
std::unique_ptr<DynamicsMethod> make_method(const Model& model, const DynamicsOptions& options) {
  return std::make_unique<Method>(model, options);
}

/// The system eliminated as it is assembled. "thomas" stands for it, unless more than the solution
/// is asked of the solver.
class FusedConstraintForce : public DynamicsMethod {
 public:
  explicit FusedConstraintForce(const Model& model) : kernel_(model) {
    f_.resize(kernel_.n_unknowns());
  }
  DynamicsReport evaluate(double, const SweepInput<double>& in, double* du,
                          double* loads) override {
    return report_of(kernel_, kernel_.evaluate(in, du, loads, f_.data()));
  }
  std::span<const double> constraint_force() const override { return f_; }

 private:
  ConstraintElimination<double> kernel_;
  std::vector<double> f_;
};

class ClosedLoops : public DynamicsMethod {
 public:
  explicit ClosedLoops(const Model& model) : kernel_(model) {}
  DynamicsReport evaluate(double, const SweepInput<double>& in, double* du,
                          double* loads) override {
    DynamicsReport report = report_of(kernel_, kernel_.evaluate(in, du, loads));
    if (report.ok() && kernel_.report().is_contradictory())
      report.outcome = Outcome::singular_position;
    report.loops = kernel_.report();
    if (loads) kernel_.coupling_loads(in.q, coupling_load_);
    return report;
  }
  bool finds_loops() const override { return true; }
  std::span<const double> coupling_load() const override { return coupling_load_; }

 private:
  ArticulatedLoops kernel_;
  std::vector<double> coupling_load_;
};

std::unique_ptr<DynamicsMethod> make_articulated_body(const Model& model,
                                                      const DynamicsOptions& options) {
  if (model.is_constrained()) return std::make_unique<ClosedLoops>(model);
  if (paths_fill(model, native_lanes))
    return std::make_unique<Recursion<ArticulatedPaths<Lanes<native_lanes>>>>(model,
                                                                              options.executor);
  auto method = std::make_unique<Recursion<ArticulatedBody<double>>>(model);
  method->kernel().share_branches(options.executor);
  return method;
}

std::unique_ptr<DynamicsMethod> make_constraint_force(const Model& model,
                                                      const DynamicsOptions& options) {
  if (model.is_constrained() || !model.own_element.empty())
    return std::make_unique<LoopedConstraintForce>(model, options);
  if (options.solver == "thomas" && !ask_for_refinement(options.solver_options))
    return std::make_unique<FusedConstraintForce>(model);
  return std::make_unique<ConstraintForce>(model, options);
}

constexpr DynamicsEntry table[] = {
    {.name = "articulated_body",
     .description = "recursion with articulated inertias, O(N)",
     .reference = "featherstone1983",
     .any_body = true,
     .own_coordinates = true,
     .linear_time = true,
     .takes_loops = true,
     .on_lanes = BatchMethod::articulated_body,
     .make = make_articulated_body},
    {.name = "constraint_force",
     .description = "joint constraint forces from A f = b with any linear solver",
     .reference = "sharf1993",
     .uses_solver = true,
     .own_coordinates = true,
     .linear_time = true,
     .takes_loops = true,
     .on_lanes = BatchMethod::constraint_force,
     .make = make_constraint_force},
    {.name = "piecewise",
     .description = "one long revolute chain in pieces: recursion inside, constraint forces "
                    "between, on lanes and threads",
     .reference = "anderson2000",
     .uses_solver = true,
     .chains_only = true,
     .linear_time = true,
     .takes_loops = true,
     .make = make_method<Piecewise>},
    {.name = "composite_rigid_body",
     .description = "joint-space mass matrix and its Cholesky factor, O(N depth) to O(N^3)",
     .reference = "walker1982",
     .any_body = true,
     .make = make_recursion<CompositeRigidBody>},
    {.name = "joint_space_conjugate_gradient",
     .description = "conjugate gradients on the joint-space mass matrix, one inverse dynamics per "
                    "iteration",
     .reference = "lee1988",
     .any_body = true,
     .make = make_method<JointSpaceConjugateGradient>},
    {.name = "global_projection",
     .description = "all bodies' motion equations projected on what the joints let through, O(N^3)",
     .reference = "hughes1985",
     .any_body = true,
     .make = make_recursion<GlobalProjection>},
};

/// A method on a machine with armatures whose axes turn.
class WithArmatureBias final : public DynamicsMethod {
 public:
  WithArmatureBias(const Model& model, std::unique_ptr<DynamicsMethod> method)
      : model_(&model), method_(std::move(method)) {}
  DynamicsReport evaluate(double t, const SweepInput<double>& in, double* du,
                          double* loads) override {
    SweepInput<double> with_bias = in;
    tau_.assign(in.tau, in.tau + model_->nv());
    if (in.v) add_armature_bias(*model_, in.v, -1, tau_.data());
    with_bias.tau = tau_.data();
    return method_->evaluate(t, with_bias, du, loads);
  }
  bool finds_loops() const override { return method_->finds_loops(); }
  void accepted(double t) override { method_->accepted(t); }
  std::span<const double> coupling_load() const override { return method_->coupling_load(); }
  std::span<const double> constraint_force() const override { return method_->constraint_force(); }

 private:
  const Model* model_;
  std::unique_ptr<DynamicsMethod> method_;
  std::vector<double> tau_;
};

std::string rounded(double x) {
  std::ostringstream text;
  text << std::setprecision(2) << x;
  return text.str();
}

void choose_for_loops(const Model& model, Choice& choice) {
  if (!model.bearings.empty()) {
    choice.method = "articulated_body";
    choice.reason = "closed loops, whose bearings share loads in the recursion alone";
    return;
  }
  if (Piecewise::closes_cheaply(model)) {
    choice.method = "piecewise";
    choice.reason = "a revolute chain of " + std::to_string(model.n_bodies()) +
                    " bodies: its pieces fill the SIMD lanes, and the loops close where pieces end";
    return;
  }
  const LoopWork work = count_loop_work(model);
  choice.method = work.prefers_graph() ? "constraint_force" : "articulated_body";
  if (work.prefers_graph())
    choice.reason = "closed loops: the sparse factor of all joint constraint forces takes " +
                    rounded(work.graph) + " multiplications, the recursion along the loops " +
                    rounded(work.recursion);
  else
    choice.reason = "closed loops, of which the recursion carries the forces to where they meet";
}

/// A machine with closed loops or flexible links is a graph, which few solvers take.
void require_solver_of_graphs(const Model& model, const std::string& solver) {
  if (find_solver(solver).takes_loops) return;
  const char* const has = model.is_constrained()
                              ? "takes trees, and this machine has closed loops or couplings"
                              : "takes rigid bodies, and this machine has flexible links";
  throw InputError("solver '" + solver + "' " + has + "; use solver thomas or conjugate_gradient");
}

}  // namespace

std::span<const DynamicsEntry> dynamics_table() { return table; }

const DynamicsEntry& find_dynamics(std::string_view name) {
  return find_named("method", name, table, "auto");
}

Choice choose_dynamics(const Model& model, const DynamicsOptions& options) {
  Choice choice{options.method, options.solver, "as asked for"};
  if (options.solver != "auto") find_solver(options.solver);
  make_initial_guess(options.initial_guess);  // refuses unknown names
  if (options.method == "auto") {
    if (options.solver != "auto") {
      choice.method = "constraint_force";
      choice.reason = "a solver was asked for, and only constraint_force uses one";
    } else if (model.is_constrained()) {
      choose_for_loops(model, choice);
    } else if (model.n_bodies() >= Piecewise::worth_cutting && Piecewise::suits(model)) {
      choice.method = "piecewise";
      choice.reason = "a revolute chain of " + std::to_string(model.n_bodies()) +
                      " bodies: its pieces fill the SIMD lanes";
    } else {
      choice.method = "articulated_body";
      choice.reason = model.singular_body() >= 0
                          ? "body '" + model.body_name(model.singular_body()) +
                                "' has a singular inertia, which only the recursion takes"
                      : paths_fill(model, native_lanes)
                          ? "the recursion, with the paths of the tree side by side in SIMD lanes"
                          : "the recursion is the fastest and the most accurate on one system";
    }
  }
  const DynamicsEntry& entry = find_dynamics(choice.method);
  require_known_bodies(model, entry);
  if (!entry.takes_loops)
    refuse_loops(model, "method " + std::string(entry.name), "use method articulated_body");
  if (!entry.uses_solver)
    choice.solver = "";
  else if (choice.solver == "auto")
    choice.solver = "thomas";
  if (entry.uses_solver && (model.is_constrained() || !model.own_element.empty()))
    require_solver_of_graphs(model, choice.solver);
  if (model.is_constrained() && !model.bearings.empty() && choice.method != "articulated_body")
    throw InputError("method " + choice.method +
                     " shares no loads among bearings; use method articulated_body, or remove the "
                     "bearings");
  return choice;
}

std::unique_ptr<DynamicsMethod> make_dynamics(const Model& model, const DynamicsOptions& options) {
  const Choice choice = choose_dynamics(model, options);
  DynamicsOptions resolved = options;
  resolved.method = choice.method;
  resolved.solver = choice.solver;
  auto method = find_dynamics(choice.method).make(model, resolved);
  if (!has_armature_bias(model)) return method;
  return std::make_unique<WithArmatureBias>(model, std::move(method));
}

}  // namespace linkwise
