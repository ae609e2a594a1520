#include "linkwise/simulate/loop_forces.hpp"

#include <algorithm>

#include "linkwise/dynamics/applied_states.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/forces/passive.hpp"

namespace linkwise {

LoopForces::LoopForces(const Setup& setup)
    : setup_(setup),
      loops_(setup.driven().loops),
      states_(setup.driven()),
      passive_(has_passive_forces(loops_)),
      near_q_(loops_.nq),
      given_v_(loops_.nv),
      given_du_(loops_.nv),
      tau_(loops_.nv),
      drive_(loops_.nv) {
  for (const Element& e : loops_.elements) turns_matter_ |= e.prescribed;
  for (const Coupling& coupling : setup.model->couplings)
    for (const Coupling::Term& term : coupling.terms) turns_matter_ |= term.closes;
}

void LoopForces::hold(const double* q) {
  LoopStates free(*setup_.model);
  SweepInput<double> in;
  in.q = q;
  free.update(in);
  near_q_ = free.q();
}

void LoopForces::give(double t) {
  for (int l = 0; l < setup_.model->n_loops(); ++l) {
    const Drive& drive = setup_.drives[setup_.model->n_joints() + l];
    if (drive.kind != DriveKind::motion) continue;
    const JointInfo& joint = loops_.joints[l].joint;
    evaluate_motion(joint, drive, t, &near_q_[joint.q], &given_v_[joint.v], &given_du_[joint.v]);
  }
}

void LoopForces::give_to(SweepInput<double>& in) const {
  in.loop_q = near_q();
  in.loop_v = given_v();
  in.loop_du = given_du_.data();
}

void LoopForces::update(double t, const double* q, const double* v) {
  give(t);
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  give_to(in);
  in.loop_q = near_q_.data();
  states_.update(in);
}

void LoopForces::evaluate(double t, const double* q, const double* v) {
  update(t, q, v);
  std::fill(tau_.begin(), tau_.end(), 0.0);
  for (int l = 0; l < setup_.model->n_loops(); ++l)
    add_drive_torque(loops_.joints[l].joint, loops_.elements,
                     setup_.drives[setup_.model->n_joints() + l], t, this->q(), this->v(),
                     tau_.data());
  drive_ = tau_;
  if (passive_) add_passive_forces(loops_, this->q(), this->v(), tau_.data());
}

void LoopForces::accepted(double t, const double* q, const double* v) {
  update(t, q, v);
  near_q_ = states_.q();
}

/// Drives are not asked: their functions may be the caller's.
void LoopForces::require_directions() const {
  if (passive_) linkwise::require_directions(*setup_.model, states_, nullptr);
}

void LoopForces::add_holding_torques(const double* loads) {
  const int n = setup_.model->n_joints();
  const auto& armature = loops_.dof[static_cast<int>(DofProperty::armature)];
  std::vector<double> held(loops_.nv), rotors(loops_.nv);
  add_armature_bias(loops_, v(), 1, rotors.data());
  for (int l = 0; l < setup_.model->n_loops(); ++l) {
    if (!is_prescribed(setup_.drives[n + l].kind)) continue;
    const JointInfo& joint = loops_.joints[l].joint;
    torques_of_load(joint, loops_.elements, q(), loads + 6 * (n + l), held.data());
    for (int k = joint.v; k < joint.v + joint.nv; ++k)
      drive_[k] += held[k] + armature[k] * given_du_[k] + rotors[k] - tau_[k];
  }
}

double LoopForces::dissipated() const {
  if (!passive_) return 0;
  std::vector<double> moving(loops_.nv), resting(loops_.nv);
  const std::vector<double> rest(loops_.nv);
  add_passive_forces(loops_, q(), v(), moving.data());
  add_passive_forces(loops_, q(), rest.data(), resting.data());
  double power = 0;
  for (int i = 0; i < loops_.nv; ++i) power -= (moving[i] - resting[i]) * v()[i];
  return power;
}

void torques_of_load(const JointInfo& joint, const std::vector<Element>& elements, const double* q,
                     const double* load, double* tau) {
  Force<double> w = transpose_times(joint.to_user, to_force(load));
  for (int i = joint.first_element + joint.n_elements - 1; i >= joint.first_element; --i) {
    const Element& e = elements[i];
    for (int k = 0; k < e.nv; ++k) tau[e.v + k] = dot(element_column<double>(e, k), w);
    w = transpose_times(element_pose(e, q), w);
  }
}

}  // namespace linkwise
