#include "linkwise/dynamics/constraint_force.hpp"

#include "linkwise/exec/thread_pool.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise {

namespace {

SolverOptions solver_options(const DynamicsOptions& options) {
  SolverOptions own = options.solver_options;
  own.executor = Executor(checked_threads(options.threads));
  return own;
}

}  // namespace

ConstraintForce::ConstraintForce(const Model& model, const DynamicsOptions& options)
    : model_(&model),
      system_(model, Executor(checked_threads(options.threads))),
      solver_(make_solver(options.solver, solver_options(options))),
      guess_(make_initial_guess(options.initial_guess, options.solver_options.own)),
      f_(system_.A().size()),
      direct_(find_solver(options.solver).kind == SolverKind::direct) {}

DynamicsReport ConstraintForce::evaluate(double t, const SweepInput<double>& in, double* du,
                                         double* loads) {
  system_.assemble(in);
  guess_->predict(t, system_.A(), system_.b(), f_);
  DynamicsReport report{solver_->solve(system_.A(), system_.b(), f_)};
  if (report.node >= 0) report.body = system_.body_of_node(report.node);
  guess_->solved(t, f_);
  system_.recover(in, f_, du, loads);
  constexpr double acceptable_violation = 1e-12;
  if (direct_ && report.ok() && system_.violation() > acceptable_violation)
    return correct(in, du, loads);
  return report;
}

DynamicsReport ConstraintForce::correct(const SweepInput<double>& in, double* du, double* loads) {
  if (!inverse_) inverse_ = std::make_unique<InverseDynamics<double>>(*model_);
  const size_t nv = model_->nv();
  missing_.resize(nv);
  ddu_.resize(nv);
  df_.resize(f_.size());
  inverse_->evaluate(in, du, missing_.data(), nullptr);
  for (size_t i = 0; i < nv; ++i) missing_[i] = in.tau[i] - missing_[i];
  SweepInput<double> rest;
  rest.q = in.q;
  rest.tau = missing_.data();
  rest.gravity_factor = 0;
  system_.assemble(rest);
  const DynamicsReport report{solver_->solve(system_.A(), system_.b(), df_)};
  system_.recover(rest, df_, ddu_.data(), nullptr);
  for (size_t i = 0; i < nv; ++i) du[i] += ddu_[i];
  for (size_t i = 0; i < f_.size(); ++i) f_[i] += df_[i];
  if (loads) inverse_->evaluate(in, du, nullptr, loads);
  return report;
}

void ConstraintForce::accepted(double t) { guess_->accept(t, f_); }

}  // namespace linkwise
