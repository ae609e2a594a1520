#include "linkwise/simulate/applied_forces.hpp"

#include <algorithm>

#include "linkwise/base/finite.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "linkwise/forces/passive.hpp"

namespace linkwise {

AppliedForces::AppliedForces(const Setup& setup, size_t members, const double* constant)
    : setup_(setup),
      members_(members),
      nv_(setup.model->nv()),
      n_load_(6 * static_cast<size_t>(setup.model->n_joints())),
      tau_(members * nv_),
      drive_(members * nv_),
      external_(setup.wrenches.empty() ? 0 : members * n_load_) {
  if (constant) constant_.assign(constant, constant + members * nv_);
  if (setup.model->n_loops() > 0) loops_.emplace(setup);
  for (const Wrench& w : setup.wrenches) world_wrenches_ |= w.world;
  poses_.resize(world_wrenches_ ? 16 * static_cast<size_t>(setup.model->n_joints()) : 0);
}

void AppliedForces::evaluate(double t, const double* q, const double* v) {
  const Model& m = *setup_.model;
  if (constant_.empty())
    std::fill(tau_.begin(), tau_.end(), 0.0);
  else
    std::copy(constant_.begin(), constant_.end(), tau_.begin());
  std::fill(external_.begin(), external_.end(), 0.0);
  if (loops_) loops_->evaluate(t, q, v);
  for (size_t i = 0; i < members_; ++i, q += m.nq(), v += nv_) {
    double* tau = tau_.data() + i * nv_;
    add_drive_torques(m, setup_.drives, t, q, v, tau);
    std::copy_n(tau, nv_, drive_.data() + i * nv_);
    add_passive_forces(m, q, v, tau);
    if (external_.empty()) continue;
    if (world_wrenches_) joint_poses(m, q, poses_.data());
    add_wrenches(m, setup_.wrenches, t, poses_.data(), external_.data() + i * n_load_);
  }
}

int AppliedForces::joint_with_bad_force(size_t member) const {
  const Model& m = *setup_.model;
  const auto bad = [](const double* first, int n) {
    return first && !all_finite({first, static_cast<size_t>(n)});
  };
  for (int j = 0; j < m.n_joints(); ++j) {
    const double* wrench = external(member);
    if (bad(tau(member) + m.joints[j].v, m.joints[j].nv) ||
        bad(wrench ? wrench + 6 * j : wrench, 6))
      return j;
  }
  for (int l = 0; loops_ && l < m.n_loops(); ++l)
    if (const JointInfo& joint = m.loops.joints[l].joint; bad(loops_->tau() + joint.v, joint.nv))
      return m.n_joints() + l;
  return -1;
}

void AppliedForces::add_holding_torques(const double* total) {
  for (size_t i = 0; i < members_; ++i)
    add_holding_torques(total + i * nv_, tau(i), drive_.data() + i * nv_);
}

void AppliedForces::add_holding_torques(const double* total, const double* tau,
                                        double* drive) const {
  for (int j = 0; j < setup_.model->n_joints(); ++j) {
    if (!is_prescribed(setup_.drives[j].kind)) continue;
    const JointInfo& info = setup_.model->joints[j];
    for (int k = info.v; k < info.v + info.nv; ++k) drive[k] += total[k] - tau[k];
  }
}

}  // namespace linkwise
