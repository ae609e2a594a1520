#include "linkwise/dynamics/constraint_force.hpp"

namespace linkwise {

namespace {

SolverOptions solver_options(const DynamicsOptions& options) {
  SolverOptions own = options.solver_options;
  own.executor = options.executor;
  return own;
}

}  // namespace

ConstraintForce::ConstraintForce(const Model& model, const DynamicsOptions& options)
    : system_(model, options.executor),
      solver_(options.solver, solver_options(options), options.initial_guess != "zero"),
      guess_(make_initial_guess(options.initial_guess, options.solver_options.own)),
      f_(system_.A().size()),
      refinement_(model) {}

DynamicsReport ConstraintForce::evaluate(double t, const SweepInput<double>& in, double* du,
                                         double* loads) {
  system_.assemble(in);
  guess_->predict(t, system_.A(), system_.b(), f_);
  DynamicsReport report{solver_.solve(system_.A(), system_.b(), f_, [&](bool with_size) {
    TreeSystem::Distance found{.with_size = with_size};
    system_.recover(in, f_, du, loads, solver_.is_direct() ? nullptr : &found);
    return MotionError{found.gap, found.size};
  })};
  if (report.node >= 0) report.body = system_.body_of_node(report.node);
  guess_->solved(t, f_);
  const double violation = system_.violation();
  const bool rough =
      solver_.is_direct() ? Refinement<double>::is_due(violation) : solver_.motion_is_rough();
  if (!report.ok() || !rough) return report;
  refinement_.refine(in, violation, du, loads, [&](const auto& rest, double* more, double* loads_) {
    df_.resize(f_.size());
    system_.assemble(rest);
    static_cast<Report&>(report) = solver_.solve(system_.A(), system_.b(), df_);
    system_.recover(rest, df_, more, loads_);
    for (size_t i = 0; i < f_.size(); ++i) f_[i] += df_[i];
  });
  return report;
}

void ConstraintForce::accepted(double t) { guess_->accept(t, f_); }

}  // namespace linkwise
