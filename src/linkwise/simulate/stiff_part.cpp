#include "linkwise/simulate/stiff_part.hpp"

#include <algorithm>
#include <cmath>

namespace linkwise {

bool StiffPart::suits(const Setup& setup) {
  return !setup.driven().is_constrained() && !setup.options.state;
}

StiffPart::StiffPart(const Setup& setup)
    : model_(setup.driven()),
      parent_axes_(model_),
      rows_(gain_rows(setup)),
      mass_(model_),
      q_(model_.nq()),
      K_(model_.nv()),
      D_(model_.nv()),
      E_(model_.nv()),
      tau_(model_.nv()),
      du_(model_.nv()) {}

/// What is negative, and so not stiff, is left out: H + E stays positive definite.
void StiffPart::find_gains(const double* y) {
  std::fill(K_.begin(), K_.end(), 0.0);
  std::fill(D_.begin(), D_.end(), 0.0);
  const double* rates = y + model_.nq();
  for (const GainRow& row : rows_) {
    const double rate = rates[row.v];
    double stiffness = row.stiffness, damping = row.damping;
    if (row.friction > 0) {
      const double slope = 1 / std::cosh(rate / row.friction_velocity);
      damping += row.friction / row.friction_velocity * slope * slope;
    }
    if (row.stop > 0) {
      const Contact at = contact(row, y[row.q], rate);
      const double k = stop_stiffness(row, at.speed);
      if (at.depth > 0 && k > 0) {
        stiffness += k;
        damping += row.stop * row.stop_damping * at.depth;
      }
    }
    K_[row.v] = std::max(0.0, stiffness);
    D_[row.v] = std::max(0.0, damping);
  }
}

bool StiffPart::factor(const double* y, double gamma) {
  gamma_ = gamma;
  q_.assign(y, y + model_.nq());
  find_gains(y);
  for (int i = 0; i < model_.nv(); ++i) E_[i] = gamma * D_[i] + gamma * gamma * K_[i];
  // The diagonal of R E R^T. The rest is of the order of differences between directions.
  for (const Element& e : model_.elements) {
    const int turning = info_of(e.kind).turning;
    if (turning == 0) continue;
    const Mat3<double> R = element_rotation(e, y);
    double own[3] = {};
    for (int k = 0; k < turning; ++k)
      for (int l = 0; l < turning; ++l) own[k] += R.m[3 * k + l] * R.m[3 * k + l] * E_[e.v + l];
    std::copy_n(own, turning, E_.begin() + e.v);
  }
  return mass_.factor(q_.data(), E_.data());
}

void StiffPart::solve(const double* r, double* z) {
  const double* const r_u = r + model_.nq();
  double* const z_u = z + model_.nq();
  for (int i = 0; i < model_.nv(); ++i) tau_[i] = gamma_ * D_[i] * r_u[i];
  for (const GainRow& row : rows_)
    if (row.q >= 0) tau_[row.v] += gamma_ * K_[row.v] * (gamma_ * r_u[row.v] + r[row.q]);
  parent_axes_.to_child(q_.data(), tau_.data());
  mass_.solve(tau_.data(), du_.data());
  parent_axes_.from_child(q_.data(), du_.data());
  for (int i = 0; i < model_.nv(); ++i) z_u[i] = r_u[i] - du_[i];
  du_.assign(z_u, z_u + model_.nv());
  parent_axes_.to_child(q_.data(), du_.data());
  for (const Element& e : model_.elements) element_position_rate(e, q_.data(), du_.data(), z);
  for (int i = 0; i < model_.nq(); ++i) z[i] = r[i] + gamma_ * z[i];
}

}  // namespace linkwise
