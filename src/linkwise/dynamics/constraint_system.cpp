#include "linkwise/dynamics/constraint_system.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/base/finite.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/solve/checked_solver.hpp"

namespace linkwise {

ConstraintSystem::ConstraintSystem(const Model& model, const BatchInput& state)
    : model_(&model), system_(model) {
  AppliedStates applied(model, 1, state);
  const SweepInput<double> in = applied[0];
  q_.assign(in.q, in.q + model.nq());
  v_.assign(in.v, in.v + model.nv());
  tau_.assign(in.tau, in.tau + model.nv());
  add_armature_bias(model, v_.data(), -1, tau_.data());
  if (in.external) external_.assign(in.external, in.external + 6 * model.n_joints());
  system_.assemble(input());
}

SweepInput<double> ConstraintSystem::input() const {
  SweepInput<double> in;
  in.q = q_.data();
  in.v = v_.data();
  in.tau = tau_.data();
  in.external = external_.empty() ? nullptr : external_.data();
  return in;
}

bool ConstraintSystem::finite() const { return all_finite(b()) && A().all_finite(); }

double ConstraintSystem::energy_norm(const std::vector<double>& f) const {
  std::vector<double> y(f.size());
  A().multiply(f, y);
  double sum = 0;
  for (size_t i = 0; i < f.size(); ++i) sum += f[i] * y[i];
  return std::sqrt(std::max(0.0, sum));
}

EvaluationReport ConstraintSystem::solve(const std::string& solver, const SolverOptions& options,
                                         std::vector<double>& f) {
  CheckedSolver checked(solver, options, false);
  std::vector<double> du(model_->nv());
  const Report report = checked.solve(A(), b(), f, [&](bool with_size) {
    TreeSystem::Distance found{.with_size = with_size};
    if (!checked.is_direct()) system_.recover(input(), f, du.data(), nullptr, &found);
    return MotionError{found.gap, found.size};
  });
  const int body = report.node >= 0 ? system_.body_of_node(report.node) : -1;
  return evaluation_report(*model_, {"constraint_force", solver, "as asked for"}, {report, body});
}

void ConstraintSystem::recover(const std::vector<double>& f, double* du, double* loads) {
  system_.recover(input(), f, du, loads);
}

}  // namespace linkwise
