#include "linkwise/dynamics/joint_space_conjugate_gradient.hpp"

#include <cmath>

#include "linkwise/solve/checked_solver.hpp"
#include "linkwise/spatial/composite.hpp"

namespace linkwise {

JointSpaceConjugateGradient::JointSpaceConjugateGradient(const Model& model,
                                                         const DynamicsOptions& options)
    : model_(&model),
      options_(options.solver_options),
      inverse_(model),
      recursion_(model),
      columns_(model),
      composite_(model.n_bodies()),
      a_(model.n_bodies()),
      w_(model.n_bodies()),
      inverse_diagonal_(columns_.count()),
      b_(columns_.count()),
      x_(columns_.count()),
      tau_(model.nv()),
      residual_(columns_.count()),
      correction_(model.nv()) {
  validate(options_);
}

/// P^T Yc P + armature, Yc the inertia of the body and all outboard of it. False where it is not
/// positive.
bool JointSpaceConjugateGradient::calc_diagonal() {
  const Model& model = *model_;
  const std::vector<double>& armature = model.dof_values(DofProperty::armature);
  for (int n = 0; n < model.n_bodies(); ++n)
    composite_[n] = with_body(model, n, [](const auto& body) { return frozen_inertia(body); });
  for (int n = model.n_bodies() - 1; n >= 0; --n) {
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k) {
      const Motion<double>& P = columns_.P(k);
      const double H = dot(P, composite_[n] * P) + armature[columns_.dof(k)];
      if (!(H > 0)) {
        failed_body_ = n;
        return false;
      }
      inverse_diagonal_[k] = 1 / H;
    }
    const int parent = model.topology[n].parent;
    if (parent >= 0) composite_[parent] += transform_to_parent(columns_.state(n).X, composite_[n]);
  }
  return true;
}

/// y = H x, in the order of the columns.
void JointSpaceConjugateGradient::multiply(std::span<const double> x, std::span<double> y) {
  const Model& model = *model_;
  for (int n = 0; n < model.n_bodies(); ++n) {
    const int parent = model.topology[n].parent;
    Motion<double> a{};
    if (parent >= 0) a = columns_.state(n).X * a_[parent];
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k) {
      const Motion<double>& P = columns_.P(k);
      a += x[k] * P;
    }
    a_[n] = a;
    w_[n] = with_body(model, n, [&](const auto& body) { return inertia_times(body, a); });
  }
  const std::vector<double>& armature = model.dof_values(DofProperty::armature);
  for (int n = model.n_bodies() - 1; n >= 0; --n) {
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k)
      y[k] = dot(columns_.P(k), w_[n]) + armature[columns_.dof(k)] * x[k];
    const int parent = model.topology[n].parent;
    if (parent >= 0) w_[parent] += transpose_times(columns_.state(n).X, w_[n]);
  }
}

/// The error of x_ in the norm of the kinetic energy: sqrt(r^T H^-1 r), and H^-1 r is what the
/// recursion makes of torques r. NaN where it fails.
double JointSpaceConjugateGradient::error(const SweepInput<double>& in) {
  multiply(x_, residual_);
  std::fill(tau_.begin(), tau_.end(), 0.0);
  for (int k = 0; k < columns_.count(); ++k) {
    residual_[k] = b_[k] - residual_[k];
    tau_[columns_.dof(k)] = residual_[k];
  }
  SweepInput<double> rest;
  rest.q = in.q;
  rest.tau = tau_.data();
  rest.gravity_factor = 0;
  if (!recursion_.evaluate(rest, correction_.data(), nullptr)) {
    failed_body_ = recursion_.failed_body();
    return std::numeric_limits<double>::quiet_NaN();
  }
  double square = 0;
  for (int k = 0; k < columns_.count(); ++k) square += residual_[k] * correction_[columns_.dof(k)];
  return std::sqrt(std::max(0.0, square));
}

/// H x = b from x_, checked as in CheckedSolver.
Report JointSpaceConjugateGradient::solve(const SweepInput<double>& in) {
  SolverOptions options = options_;
  const int limit =
      options_.max_iterations > 0 ? options_.max_iterations : 10 * columns_.count() + 100;
  Report report;
  for (Strictness strictness(1.0);;) {
    options.tolerance = strictness.value() * options_.tolerance;
    options.absolute_tolerance = strictness.value() * options_.absolute_tolerance;
    stop_.start(options, nullptr, limit - report.iterations);
    stop_.set_right_hand_side(b_);
    conjugate_gradients(
        b_, x_, stop_, work_,
        [this](std::span<const double> x, std::span<double> y) { multiply(x, y); },
        [this](std::span<const double> r, std::span<double> z) -> std::span<const double> {
          for (size_t k = 0; k < r.size(); ++k) z[k] = inverse_diagonal_[k] * r[k];
          return z;
        },
        options_.executor);
    report = {stop_.outcome(), report.iterations + stop_.iterations(), stop_.relative_error()};
    const double off = error(in);
    if (failed_body_ >= 0) report.outcome = Outcome::not_positive_definite;  // H is singular
    if (!std::isfinite(off)) return report;
    const double energy = std::sqrt(std::max(0.0, dot(x_, b_)));
    report.error_estimate = energy > 0.0 ? off / energy : off;
    report.error_is_bound = true;
    if (!report.ok() || options_.stop != StopRule::energy_norm) return report;
    const double excess = off / (options_.tolerance * energy + options_.absolute_tolerance);
    if (excess <= Strictness::slack) return report;
    if (report.iterations >= limit) {
      report.outcome = Outcome::reached_max_iterations;
      return report;
    }
    if (!strictness.tighten(excess, false)) {
      report.outcome = Outcome::stagnated;
      return report;
    }
  }
}

DynamicsReport JointSpaceConjugateGradient::evaluate(double, const SweepInput<double>& in,
                                                     double* du, double* loads) {
  const Model& model = *model_;
  DynamicsReport report;
  failed_body_ = -1;
  for (int i = 0; i < model.nv(); ++i) du[i] = 0;
  for (int n = 0; n < model.n_bodies(); ++n) copy_prescribed(model, model.topology[n], in, du);
  inverse_.evaluate(in, du, tau_.data(), nullptr);
  columns_.update(in);
  if (!calc_diagonal()) {
    report.outcome = Outcome::not_positive_definite;
    report.body = failed_body_;
    return report;
  }
  for (int k = 0; k < columns_.count(); ++k) {
    b_[k] = in.tau[columns_.dof(k)] - tau_[columns_.dof(k)];
    x_[k] = 0;
  }
  if (sum_of_squares(b_) != 0.0) static_cast<Report&>(report) = solve(in);
  report.body = failed_body_;
  for (int k = 0; k < columns_.count(); ++k) du[columns_.dof(k)] = x_[k];
  if (loads) inverse_.evaluate(in, du, nullptr, loads);
  return report;
}

}  // namespace linkwise
