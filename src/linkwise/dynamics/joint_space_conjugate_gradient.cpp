#include "linkwise/dynamics/joint_space_conjugate_gradient.hpp"

#include "linkwise/spatial/composite.hpp"

namespace linkwise {

JointSpaceConjugateGradient::JointSpaceConjugateGradient(const Model& model,
                                                         const DynamicsOptions& options)
    : model_(&model),
      options_(options.solver_options),
      inverse_(model),
      columns_(model),
      composite_(model.n_bodies()),
      a_(model.n_bodies()),
      w_(model.n_bodies()),
      inverse_diagonal_(columns_.count()),
      b_(columns_.count()),
      x_(columns_.count()),
      tau_(model.nv()) {
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
      a += Motion<double>{x[k] * P.lin, x[k] * P.ang};
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

DynamicsReport JointSpaceConjugateGradient::evaluate(double, const SweepInput<double>& in,
                                                     double* du, double* loads) {
  const Model& model = *model_;
  DynamicsReport report;
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
  const int limit =
      options_.max_iterations > 0 ? options_.max_iterations : 10 * columns_.count() + 100;
  stop_.start(options_, nullptr, limit);
  stop_.set_right_hand_side(b_);
  if (sum_of_squares(b_) != 0.0) {
    conjugate_gradients(
        b_, x_, stop_, work_,
        [this](std::span<const double> x, std::span<double> y) { multiply(x, y); },
        [this](std::span<const double> r, std::span<double> z) -> std::span<const double> {
          for (size_t k = 0; k < r.size(); ++k) z[k] = inverse_diagonal_[k] * r[k];
          return z;
        },
        options_.executor);
    static_cast<Report&>(report) = {stop_.outcome(), stop_.iterations(), stop_.relative_error(),
                                    -1};
  }
  for (int k = 0; k < columns_.count(); ++k) du[columns_.dof(k)] = x_[k];
  if (loads) inverse_.evaluate(in, du, nullptr, loads);
  return report;
}

}  // namespace linkwise
