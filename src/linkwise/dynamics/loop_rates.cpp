#include "linkwise/dynamics/loop_rates.hpp"

#include <algorithm>

namespace linkwise {

LoopRates::LoopRates(const Model& model)
    : model_(model),
      armature_(model.loops.dof[static_cast<int>(DofProperty::armature)]),
      any_rotors_(std::any_of(armature_.begin(), armature_.end(), [](double x) { return x > 0; })),
      states_(model),
      tree_(model),
      frame_(model.n_bodies(), -1),
      external_(6 * static_cast<size_t>(model.n_joints())),
      torque_(model.nv()),
      tau_l_(model.loops.nv),
      du_l_(model.loops.nv),
      x_(model.nv()),
      y_(model.nv()) {
  for (int j = 0; j < model.n_joints(); ++j)
    if (model.joints[j].last_of_body) frame_[model.joints[j].body] = j;
}

std::span<const double> LoopRates::rates(const double* q, const double* u) {
  SweepInput<double> in;
  in.q = q;
  in.v = u;
  states_.update(in);
  return states_.v();
}

/// u_l' = P^+ (X_F a_b - X_FA a_a - c).
std::span<const double> LoopRates::accelerations(const double* q, const double* u,
                                                 const double* du) {
  rates(q, u);
  SweepInput<double> in;
  in.q = q;
  in.v = u;
  in.gravity_factor = 0;
  tree_.evaluate(in, du, nullptr, nullptr);
  const auto of = [&](int body) { return body < 0 ? Motion<double>{} : tree_.acceleration(body); };
  for (int l = 0; l < model_.n_loops(); ++l) {
    const LoopJoint& loop = model_.loops.joints[l];
    const LoopState& state = states_[l];
    const Vector6<double> b = to_array(loop.on_child * of(loop.joint.body)),
                          a = to_array(state.X_FA * of(loop.parent_body));
    Vector6<double> left;
    for (int i = 0; i < 6; ++i) left[i] = b[i] - a[i] - state.c[i];
    for (int k = 0; k < state.basis.n; ++k) du_l_[state.dof[k]] = along(state.basis.dual[k], left);
  }
  return du_l_;
}

/// Wrenches on the two bodies of each loop joint, carried inward by the tree at rest.
void LoopRates::add_torques(const double* q, const double* tau_l, double* torque) {
  std::fill(external_.begin(), external_.end(), 0.0);
  const auto push = [&](int body, const Force<double>& w) {
    if (body < 0) return;
    const auto user = to_array(inverse_transpose_times(model_.joints[frame_[body]].to_user, w));
    for (int i = 0; i < 6; ++i) external_[6 * frame_[body] + i] += user[i];
  };
  for (int l = 0; l < model_.n_loops(); ++l) {
    const LoopState& state = states_[l];
    Vector6<double> w{};
    for (int k = 0; k < state.basis.n; ++k)
      for (int i = 0; i < 6; ++i) w[i] += tau_l[state.dof[k]] * state.basis.dual[k][i];
    const Force<double> wrench{{w[0], w[1], w[2]}, {w[3], w[4], w[5]}};
    push(model_.loops.joints[l].joint.body, wrench_on_b(model_.loops.joints[l], wrench));
    push(model_.loops.joints[l].parent_body, wrench_on_a(state, wrench));
  }
  SweepInput<double> in;
  in.q = q;
  in.external = external_.data();
  in.gravity_factor = 0;
  tree_.evaluate(in, nullptr, torque_.data(), nullptr);
  for (int i = 0; i < model_.nv(); ++i) torque[i] -= torque_[i];
}

void LoopRates::add_rotors(const double* q, const double* x, double* y) {
  if (!any_rotors_) return;
  const std::span<const double> turning = rates(q, x);
  for (size_t k = 0; k < tau_l_.size(); ++k) tau_l_[k] = armature_[k] * turning[k];
  add_torques(q, tau_l_.data(), y);
}

void LoopRates::add_rotors_to(const double* q, double* H) {
  if (!any_rotors_) return;
  const int nv = model_.nv();
  std::vector<int> free;
  for (const Element& e : model_.elements)
    for (int i = e.v; !e.prescribed && i < e.v + e.nv; ++i) free.push_back(i);
  for (const int j : free) {
    x_[j] = 1;
    std::fill(y_.begin(), y_.end(), 0.0);
    add_rotors(q, x_.data(), y_.data());
    x_[j] = 0;
    for (const int i : free) H[i * nv + j] += y_[i];
  }
  for (int j = 0; j < nv; ++j)  // to the last bit
    for (int i = 0; i < j; ++i) H[i * nv + j] = H[j * nv + i];
}

}  // namespace linkwise
