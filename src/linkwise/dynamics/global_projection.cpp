#include "linkwise/dynamics/global_projection.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "linkwise/base/error.hpp"
#include "linkwise/base/tolerances.hpp"

namespace linkwise {
GlobalProjection::GlobalProjection(const Model& model)
    : model_(&model),
      inverse_(model),
      columns_(model),
      J_(model.n_bodies()),
      where_(model.n_bodies()),
      a0_(model.n_bodies()) {
  constexpr int limit = 4000;
  if (model.nv() > limit)
    throw InputError("method global_projection needs dense matrices of " +
                     std::to_string(model.nv()) + " columns; use articulated_body above " +
                     std::to_string(limit) + " degrees of freedom");
  for (int n = 0; n < model.n_bodies(); ++n) {
    if (const int parent = model.topology[n].parent; parent >= 0) where_[n] = where_[parent];
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k) where_[n].push_back(k);
    J_[n].resize(where_[n].size());
  }
}

void GlobalProjection::calc_projection() {
  for (int n = 0; n < model_->n_bodies(); ++n) {
    const int parent = model_->topology[n].parent;
    size_t at = 0;
    for (; parent >= 0 && at < J_[parent].size(); ++at)
      J_[n][at] = columns_.state(n).X * J_[parent][at];
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k) J_[n][at++] = columns_.P(k);
  }
}

/// H = J^T M J + armature, and the right-hand side. What is prescribed is part of c.
void GlobalProjection::project(const SweepInput<double>& in) {
  const Model& model = *model_;
  const size_t size = columns_.count();
  H_.assign(size * size, 0.0);
  rhs_.assign(size, 0.0);
  const Motion<double> ground = ground_acceleration<double>(model, in.gravity_factor);
  for (int n = 0; n < model.n_bodies(); ++n) {
    const auto times = [&](const Motion<double>& a) {
      return with_body(model, n, [&](const auto& body) { return inertia_times(body, a); });
    };
    const int parent = model.topology[n].parent;
    a0_[n] = columns_.state(n).X * (parent >= 0 ? a0_[parent] : ground);
    a0_[n] += columns_.state(n).c;
    Force<double> load = times(a0_[n]);
    load += columns_.state(n).bias;
    for (size_t i = 0; i < J_[n].size(); ++i) {
      rhs_[where_[n][i]] -= dot(J_[n][i], load);
      const Force<double> MJ = times(J_[n][i]);
      double* row = &H_[size * where_[n][i]];
      for (size_t j = 0; j <= i; ++j) row[where_[n][j]] += dot(J_[n][j], MJ);
    }
  }
  const std::vector<double>& armature = model.dof_values(DofProperty::armature);
  for (size_t k = 0; k < size; ++k) {
    const int dof = columns_.dof(k);
    H_[size * k + k] += armature[dof];
    rhs_[k] += in.tau[dof];
  }
}

/// Cholesky of the lower triangle of H in place; the solution in rhs_. It shares no code with what
/// it is compared with.
bool GlobalProjection::factor_and_solve() {
  const size_t size = columns_.count();
  for (size_t k = 0; k < size; ++k) {
    double* row = &H_[size * k];
    const double whole = row[k];
    for (size_t i = 0; i <= k; ++i) {
      const double* other = &H_[size * i];
      double sum = row[i];
      for (size_t j = 0; j < i; ++j) sum -= row[j] * other[j];
      row[i] = i < k ? sum / other[i] : sum;
    }
    if (!(row[k] > smallest_pivot * whole)) {
      for (int n = 0; n < model_->n_bodies(); ++n)
        if (columns_.first(n) <= static_cast<int>(k)) failed_body_ = n;
      return false;
    }
    row[k] = std::sqrt(row[k]);
    for (size_t j = 0; j < k; ++j) rhs_[k] -= row[j] * rhs_[j];
    rhs_[k] /= row[k];
  }
  for (size_t k = size; k-- > 0;) {
    rhs_[k] /= H_[size * k + k];
    for (size_t j = 0; j < k; ++j) rhs_[j] -= H_[size * k + j] * rhs_[k];
  }
  return true;
}

bool GlobalProjection::evaluate(const SweepInput<double>& in, double* du, double* loads) {
  const Model& model = *model_;
  failed_body_ = -1;
  std::fill_n(du, model.nv(), 0.0);
  for (int n = 0; n < model.n_bodies(); ++n) copy_prescribed(model, model.topology[n], in, du);
  columns_.update(in);
  calc_projection();
  project(in);
  if (!factor_and_solve()) return false;
  for (int k = 0; k < columns_.count(); ++k) du[columns_.dof(k)] = rhs_[k];
  if (loads) inverse_.evaluate(in, du, nullptr, loads);
  return true;
}

}  // namespace linkwise
