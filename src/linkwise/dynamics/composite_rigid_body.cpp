#include "linkwise/dynamics/composite_rigid_body.hpp"

#include <cmath>
#include <new>

#include "linkwise/base/error.hpp"
#include "linkwise/base/tolerances.hpp"
#include "linkwise/spatial/composite.hpp"

namespace linkwise {

CompositeRigidBody::CompositeRigidBody(const Model& model)
    : model_(&model), inverse_(model), columns_(model), composite_(model.n_bodies()) {
  constexpr int limit = 20000;
  if (model.nv() > limit)
    throw InputError("method composite_rigid_body needs a dense " + std::to_string(model.nv()) +
                     " x " + std::to_string(model.nv()) + " matrix (" +
                     std::to_string(static_cast<long>(8e-9 * model.nv() * model.nv())) +
                     " GB); use articulated_body above " + std::to_string(limit) +
                     " degrees of freedom");
  std::vector<int> last(model.n_bodies(), -1);
  for (int n = 0; n < model.n_bodies(); ++n) {
    const int parent = model.topology[n].parent;
    int previous = parent >= 0 ? last[parent] : -1;
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k) {
      before_.push_back(previous);
      previous = k;
    }
    last[n] = previous;
  }
  tau_.resize(model.nv());
  rhs_.resize(columns_.count());
}

/// Lower triangle of H in sweep order, in H_.
void CompositeRigidBody::calc_columns(const double* q) {
  const Model& model = *model_;
  const size_t n_dof = columns_.count();
  H_.assign(n_dof * n_dof, 0.0);
  SweepInput<double> in;
  in.q = q;
  columns_.update(in);
  for (int n = 0; n < model.n_bodies(); ++n)
    composite_[n] = with_body(model, n, [](const auto& body) { return frozen_inertia(body); });
  const auto& armature = model.dof_values(DofProperty::armature);
  for (int n = model.n_bodies() - 1; n >= 0; --n) {
    const int parent = model.topology[n].parent;
    if (parent >= 0) composite_[parent] += transform_to_parent(columns_.state(n).X, composite_[n]);
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k) {
      Force<double> F = composite_[n] * columns_.P(k);
      double* const row = &H_[k * n_dof];
      for (int a = n;;) {
        const int end = a == n ? k + 1 : columns_.first(a + 1);
        for (int i = columns_.first(a); i < end; ++i) row[i] = dot(columns_.P(i), F);
        if (model.topology[a].parent < 0) break;
        F = transpose_times(columns_.state(a).X, F);
        a = model.topology[a].parent;
      }
      row[k] += armature[columns_.dof(k)];
    }
  }
}

void CompositeRigidBody::mass_matrix(const double* q, double* H) {
  calc_columns(q);
  const size_t nv = model_->nv(), n_dof = columns_.count();
  for (size_t i = 0; i < nv * nv; ++i) H[i] = 0;
  for (size_t i = 0; i < nv; ++i) H[i * nv + i] = 1;
  for (size_t i = 0; i < n_dof; ++i)
    for (size_t j = 0; j <= i; ++j)
      H[columns_.dof(i) * nv + columns_.dof(j)] = H[columns_.dof(j) * nv + columns_.dof(i)] =
          H_[i * n_dof + j];
}

/// H = L^T L in place, from the tips down, so that zeros stay zeros, which no other factor here
/// does; returns false at a pivot that is not positive.
bool CompositeRigidBody::factor() {
  const int n_dof = columns_.count();
  std::vector<double> whole(n_dof);
  for (int k = 0; k < n_dof; ++k) whole[k] = H_[static_cast<size_t>(k) * n_dof + k];
  for (int k = n_dof - 1; k >= 0; --k) {
    double* row = &H_[static_cast<size_t>(k) * n_dof];
    if (!(row[k] > smallest_pivot * whole[k])) {
      for (int n = 0; n < model_->n_bodies(); ++n)
        if (columns_.first(n) <= k) failed_body_ = n;
      return false;
    }
    row[k] = std::sqrt(row[k]);
    for (int i = before_[k]; i >= 0; i = before_[i]) row[i] /= row[k];
    for (int i = before_[k]; i >= 0; i = before_[i])
      for (int j = i; j >= 0; j = before_[j])
        H_[static_cast<size_t>(i) * n_dof + j] -= row[i] * row[j];
  }
  return true;
}

bool CompositeRigidBody::evaluate(const SweepInput<double>& in, double* du, double* loads) {
  failed_body_ = -1;
  const int n_dof = columns_.count();
  for (int i = 0; i < model_->nv(); ++i) du[i] = 0;
  for (int n = 0; n < model_->n_bodies(); ++n)
    copy_prescribed(*model_, model_->topology[n], in, du);
  inverse_.evaluate(in, du, tau_.data(), nullptr);
  calc_columns(in.q);
  if (!factor()) return false;
  for (int i = 0; i < n_dof; ++i) rhs_[i] = in.tau[columns_.dof(i)] - tau_[columns_.dof(i)];
  for (int i = n_dof - 1; i >= 0; --i) {  // L^T y = rhs
    const double* row = &H_[static_cast<size_t>(i) * n_dof];
    rhs_[i] /= row[i];
    for (int j = before_[i]; j >= 0; j = before_[j]) rhs_[j] -= row[j] * rhs_[i];
  }
  for (int i = 0; i < n_dof; ++i) {  // L x = y
    const double* row = &H_[static_cast<size_t>(i) * n_dof];
    for (int j = before_[i]; j >= 0; j = before_[j]) rhs_[i] -= row[j] * rhs_[j];
    rhs_[i] /= row[i];
  }
  for (int i = 0; i < n_dof; ++i) du[columns_.dof(i)] = rhs_[i];
  if (loads) inverse_.evaluate(in, du, nullptr, loads);
  return true;
}

}  // namespace linkwise
