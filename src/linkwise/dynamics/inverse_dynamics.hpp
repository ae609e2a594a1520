#pragma once
// Newton-Euler recursion [luh1980; featherstone2008, ch. 5]: accelerations outward, wrenches
// inward,
//     a_n = X_n a_p + P du + c,  w_n = M_n a_n + p_n + sum X_k^T w_k,  tau = P^T w + armature du.
// w_n is the joint load, so this is also the witness for the loads of every other method.
#include <vector>

#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

template <class S>
class InverseDynamics {
 public:
  explicit InverseDynamics(const Model& model)
      : model_(&model),
        state_(model.n_bodies()),
        general_(model.n_general),
        a_(model.n_bodies()),
        w_(model.n_bodies()) {}

  /// tau [nv] and loads [n_joints][6], either may be null. in.tau is not read; in.v null: resting.
  void evaluate(SweepInput<S> in, const S* du, S* tau, S* loads) {
    const Model& model = *model_;
    in.prescribed = du;
    calc_body_states(model, in, state_.data(), general_.data());
    base_to_tip(in, du);
    for (int n = model.n_bodies() - 1; n >= 0; --n)
      if (const int parent = model.topology[n].parent; parent >= 0)
        w_[parent] += transpose_times(state_[n].X, w_[n]);
    if (tau) project(in, du, tau);
    if (loads)
      store_joint_loads(
          model, in.q, [&](int n) -> const Force<S>& { return w_[n]; }, loads);
  }

  const std::vector<BodyState<S>>& states() const { return state_; }
  /// Acceleration of body n in its frame, gravity included (a_0 = -g).
  const Motion<S>& acceleration(int n) const { return a_[n]; }

 private:
  void base_to_tip(const SweepInput<S>& in, const S* du) {
    const Model& model = *model_;
    const Motion<S> ground = ground_acceleration<S>(model, in.gravity_factor);
    for_kind_ranges_base_to_tip(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& body = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        const Motion<S>& a_parent = body.parent >= 0 ? a_[body.parent] : ground;
        Motion<S> a = state_[n].X * a_parent;
        a += state_[n].c;
        if constexpr (is_general<J>) {
          const GeneralState<S>& g = general_[body.general];
          for (int i = 0; i < g.n; ++i) {
            const S rate = du ? du[g.dof[i]] : S{};
            a += Motion<S>{rate * g.P[i].lin, rate * g.P[i].ang};
          }
        } else {
          J::add_rate(a, k.pitch, du ? du[body.v] : S{});
        }
        a_[n] = a;
        w_[n] = momentum(k.inertia, a);
        w_[n] += state_[n].bias;
      }
    });
  }

  void project(const SweepInput<S>& in, const S* du, S* tau) {
    const Model& model = *model_;
    for_kind_ranges_base_to_tip(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& body = model.topology[n];
        if constexpr (is_general<J>) {
          Force<S> w = w_[n];
          for (int i = body.n_elements - 1; i >= 0; --i) {
            const Element& e = model.elements[body.first_element + i];
            for (int k = 0; k < e.nv; ++k) tau[e.v + k] = dot(element_column<S>(e, k), w);
            if (i > 0) w = transpose_times(element_pose(e, in.q), w);
          }
        } else {
          tau[body.v] = J::project(w_[n], model.constants[n].pitch);
        }
      }
    });
    if (!du) return;
    const auto& armature = model.dof_values(DofProperty::armature);
    for (int i = 0; i < model.nv(); ++i) tau[i] += armature[i] * du[i];
  }

  const Model* model_;
  std::vector<BodyState<S>> state_;
  std::vector<GeneralState<S>> general_;
  std::vector<Motion<S>> a_;
  std::vector<Force<S>> w_;
};

}  // namespace linkwise
