#include "linkwise/dynamics/constraint_force.hpp"

#include "linkwise/solve/registry.hpp"

namespace linkwise {

ConstraintForce::ConstraintForce(const Model& model, const DynamicsOptions& options)
    : system_(model),
      solver_(make_solver(options.solver, options.solver_options)),
      guess_(make_initial_guess(options.initial_guess, {options.history})),
      f_(system_.A().size()) {}

DynamicsReport ConstraintForce::evaluate(double t, const SweepInput<double>& in, double* du,
                                         double* loads) {
  system_.assemble(in);
  guess_->predict(t, system_.A(), system_.b(), f_);
  DynamicsReport report{solver_->solve(system_.A(), system_.b(), f_)};
  if (report.node >= 0) report.body = system_.body_of_node(report.node);
  guess_->solved(t, f_);
  system_.recover(in, f_, du, loads);
  return report;
}

void ConstraintForce::accepted(double t) { guess_->accept(t, f_); }

}  // namespace linkwise
