#include "linkwise/dynamics/composite_rigid_body.hpp"

#include <cmath>
#include <new>

#include "linkwise/base/error.hpp"
#include "linkwise/kinematics/body_columns.hpp"
#include "linkwise/recursion/tolerances.hpp"
#include "linkwise/spatial/composite.hpp"

namespace linkwise {

CompositeRigidBody::CompositeRigidBody(const Model& model)
    : model_(&model),
      inverse_(model),
      state_(model.n_bodies()),
      general_(model.n_general),
      composite_(model.n_bodies()) {
  constexpr int limit = 20000;
  if (model.nv() > limit)
    throw InputError("method composite_rigid_body needs a dense " + std::to_string(model.nv()) +
                     " x " + std::to_string(model.nv()) + " matrix (" +
                     std::to_string(static_cast<long>(8e-9 * model.nv() * model.nv())) +
                     " GB); use articulated_body above " + std::to_string(limit) +
                     " degrees of freedom");
  std::vector<int> last(model.n_bodies(), -1);
  for (int n = 0; n < model.n_bodies(); ++n) {
    const BodyTopology& body = model.topology[n];
    first_.push_back(static_cast<int>(dof_.size()));
    int previous = body.parent >= 0 ? last[body.parent] : -1;
    for (int i = 0; i < body.n_elements; ++i) {
      const Element& e = model.elements[body.first_element + i];
      if (e.prescribed) continue;
      for (int k = 0; k < e.nv; ++k) {
        before_.push_back(previous);
        previous = static_cast<int>(dof_.size());
        dof_.push_back(e.v + k);
      }
    }
    last[n] = previous;
  }
  tau_.resize(model.nv());
  rhs_.resize(dof_.size());
}

/// Lower triangle of H in sweep order, in H_.
void CompositeRigidBody::calc_columns(const double* q) {
  const Model& model = *model_;
  const size_t n_dof = dof_.size();
  H_.assign(n_dof * n_dof, 0.0);
  SweepInput<double> in;
  in.q = q;
  calc_body_states(model, in, state_.data(), general_.data());
  for (int n = 0; n < model.n_bodies(); ++n) composite_[n] = model.constants[n].inertia;
  const auto& armature = model.dof_values(DofProperty::armature);
  for (int n = model.n_bodies() - 1; n >= 0; --n) {
    const int parent = model.topology[n].parent;
    if (parent >= 0) composite_[parent] += transform_to_parent(state_[n].X, composite_[n]);
    Motion<double> P[6], Pa[6];
    int dof[6], dof_a[6];
    const int n_own = body_columns(model, n, general_, P, dof);
    for (int k = 0; k < n_own; ++k) {
      Force<double> F = composite_[n] * P[k];
      const size_t row = first_[n] + k;
      for (int a = n;;) {
        const int n_a = a == n ? k + 1 : body_columns(model, a, general_, Pa, dof_a);
        for (int i = 0; i < n_a; ++i)
          H_[row * n_dof + first_[a] + i] = dot(a == n ? P[i] : Pa[i], F);
        if (model.topology[a].parent < 0) break;
        F = transpose_times(state_[a].X, F);
        a = model.topology[a].parent;
      }
      H_[row * n_dof + row] += armature[dof[k]];
    }
  }
}

void CompositeRigidBody::mass_matrix(const double* q, double* H) {
  calc_columns(q);
  const size_t nv = model_->nv(), n_dof = dof_.size();
  for (size_t i = 0; i < nv * nv; ++i) H[i] = 0;
  for (size_t i = 0; i < nv; ++i) H[i * nv + i] = 1;
  for (size_t i = 0; i < n_dof; ++i)
    for (size_t j = 0; j <= i; ++j)
      H[dof_[i] * nv + dof_[j]] = H[dof_[j] * nv + dof_[i]] = H_[i * n_dof + j];
}

/// H = L^T L in place, from the tips down, so that zeros stay zeros, which no other factor here
/// does; returns false at a pivot that is not positive.
bool CompositeRigidBody::factor() {
  const int n_dof = static_cast<int>(dof_.size());
  std::vector<double> whole(n_dof);
  for (int k = 0; k < n_dof; ++k) whole[k] = H_[static_cast<size_t>(k) * n_dof + k];
  for (int k = n_dof - 1; k >= 0; --k) {
    double* row = &H_[static_cast<size_t>(k) * n_dof];
    if (!(row[k] > smallest_pivot * whole[k])) {
      for (int n = 0; n < model_->n_bodies(); ++n)
        if (first_[n] <= k) failed_body_ = n;
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
  const int n_dof = static_cast<int>(dof_.size());
  for (int i = 0; i < model_->nv(); ++i) du[i] = 0;
  for (int n = 0; n < model_->n_bodies(); ++n)
    copy_prescribed(*model_, model_->topology[n], in, du);
  inverse_.evaluate(in, du, tau_.data(), nullptr);
  calc_columns(in.q);
  if (!factor()) return false;
  for (int i = 0; i < n_dof; ++i) rhs_[i] = in.tau[dof_[i]] - tau_[dof_[i]];
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
  for (int i = 0; i < n_dof; ++i) du[dof_[i]] = rhs_[i];
  if (loads) inverse_.evaluate(in, du, nullptr, loads);
  return true;
}

}  // namespace linkwise
