#pragma once
// A state in uniform form, for code off the fast path: the motion subspace of every body as a list
// of columns, whatever its joint.
#include <algorithm>
#include <vector>

#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

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
        if (!e.prescribed && e.kind != ElementKind::elastic) count_ += e.nv;
      }
    }
    first_.push_back(count_);
    P_.resize(count_);
    dof_.resize(count_);
  }

  void update(const SweepInput<double>& in) {
    calc_body_states(*model_, in, state_.data(), general_.data());
    for (int n = 0; n < model_->n_bodies(); ++n) {
      const BodyTopology& body = model_->topology[n];
      if (body.joint_kind == JointKind::general) {
        const GeneralState<double>& g = general_[body.general];
        std::copy_n(g.P, g.n, P_.begin() + first_[n]);
        std::copy_n(g.dof, g.n, dof_.begin() + first_[n]);
      } else {
        P_[first_[n]] = element_column<double>(model_->elements[body.first_element], 0);
        dof_[first_[n]] = body.v;
      }
    }
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
