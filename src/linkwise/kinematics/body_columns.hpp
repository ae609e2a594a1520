#pragma once
// A state in uniform form, for code off the fast path: the motion subspace of every body as a list
// of columns, whatever its joint.
#include <vector>

#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

/// Fills P and the indices in v of a body's free degrees of freedom; returns their number.
/// `general` as calc_body_states left it.
inline int body_columns(const Model& model, int n, const std::vector<GeneralState<double>>& general,
                        Motion<double>* P, int* dof) {
  const BodyTopology& body = model.topology[n];
  if (body.joint_kind == JointKind::general) {
    const auto& g = general[body.general];
    for (int i = 0; i < g.n; ++i) {
      P[i] = g.P[i];
      dof[i] = g.dof[i];
    }
    return g.n;
  }
  P[0] = element_column<double>(model.elements[body.first_element], 0);
  dof[0] = body.v;
  return 1;
}

/// Columns of all bodies, parents first; those of body n are first(n) to first(n + 1) - 1.
class BodyColumns {
 public:
  explicit BodyColumns(const Model& model)
      : model_(&model), state_(model.n_bodies()), general_(model.n_general) {
    for (int n = 0; n < model.n_bodies(); ++n) {
      first_.push_back(count_);
      const BodyTopology& body = model.topology[n];
      for (int i = 0; i < body.n_elements; ++i) {
        const Element& e = model.elements[body.first_element + i];
        if (!e.prescribed) count_ += e.nv;
      }
    }
    first_.push_back(count_);
    P_.resize(count_);
    dof_.resize(count_);
  }

  void update(const SweepInput<double>& in) {
    calc_body_states(*model_, in, state_.data(), general_.data());
    for (int n = 0; n < model_->n_bodies(); ++n)
      body_columns(*model_, n, general_, P_.data() + first_[n], dof_.data() + first_[n]);
  }

  int count() const { return count_; }
  int first(int n) const { return first_[n]; }
  const Motion<double>& P(int k) const { return P_[k]; }
  int dof(int k) const { return dof_[k]; }
  const BodyState<double>& state(int n) const { return state_[n]; }
  BodyState<double>& state(int n) { return state_[n]; }

 private:
  const Model* model_;
  std::vector<BodyState<double>> state_;
  std::vector<GeneralState<double>> general_;
  std::vector<Motion<double>> P_;
  std::vector<int> dof_, first_;
  int count_ = 0;
};

}  // namespace linkwise
