#pragma once
// Newton-Euler recursion [luh1980; featherstone2008, ch. 5]: accelerations outward, wrenches
// inward,
//     a_n = X_n a_p + P du + c,  w_n = M_n a_n + p_n + sum X_k^T w_k,  tau = P^T w + armature du.
// w_n is the joint load, so this is also the witness for the loads of every other method.
#include <vector>

#include "linkwise/kinematics/user_frames.hpp"
#include "linkwise/recursion/stack_steps.hpp"

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
  /// What armatures of turning rates add to tau (forces/armature_bias.hpp) is the caller's.
  void evaluate(SweepInput<S> in, const S* du, S* tau, S* loads) {
    const Model& model = *model_;
    in.prescribed = du;
    calc_body_states(model, in, state_.data(), general_.data());
    base_to_tip(in, du, tau);
    tip_to_base(in, tau);
    if (tau && du) {
      const auto& armature = model.dof_values(DofProperty::armature);
      for (int i = 0; i < model.nv(); ++i) tau[i] += armature[i] * du[i];
    }
    if (loads)
      store_joint_loads(
          model, in.q, [&](int n) -> const Force<S>& { return w_[n]; }, loads);
  }

  const std::vector<BodyState<S>>& states() const { return state_; }
  /// Acceleration of body n in its frame, gravity included (a_0 = -g).
  const Motion<S>& acceleration(int n) const { return a_[n]; }

 private:
  void base_to_tip(const SweepInput<S>& in, const S* du, S* tau) {
    const Model& model = *model_;
    const Motion<S> ground = ground_acceleration<S>(model, in.gravity_factor);
    const auto acceleration_of = [&](int n) -> const Motion<S>& { return a_[n]; };
    const auto step = [&](auto joint, int n, const auto& own, const Motion<S>& a_parent) {
      using J = decltype(joint);
      const BodyTopology& body = model.topology[n];
      const BodyConstants<double>& k = model.constants[n];
      Motion<S> a = state_[n].X * a_parent;
      a += state_[n].c;
      if constexpr (is_general<J>)
        if (du && on_port(model, body))
          add_port_rates(in, model.elements[body.first_element], du, a);
      if constexpr (!is_general<J>)
        J::add_rate(a, k.pitch, du ? du[body.v] : S{});
      else if (du)
        add_rates(general_[body.general], du, a);
      a_[n] = a;
      w_[n] = {};
      if constexpr (has_coordinates<std::remove_cvref_t<decltype(own)>>) {
        const int first = own_place(model, n);
        OwnEquationsHere<S> blocks;
        calc_equations(own, state_[n].v, own_state(model, in, n), blocks);
        blocks.p = state_[n].bias;  // with external wrenches
        add_own_load(own.n_coordinates(), blocks, a, du ? du + first : nullptr, w_[n],
                     tau ? tau + first : nullptr);
      } else {
        inward_load(own, a, state_[n].bias, w_[n]);
      }
    };
    sweep_bodies_outward(model, model.kind_ranges, ground, acceleration_of, step);
  }

  /// What the coordinates of an elastic body give to what its port carries.
  static void add_port_rates(const SweepInput<S>& in, const Element& e, const S* du, Motion<S>& a) {
    for_columns(e, in.q, [&](int k, const Motion<S>& column) { a += du[e.v + k] * column; });
  }

  void tip_to_base(const SweepInput<S>& in, S* tau) {
    const Model& model = *model_;
    for_bodies_tip_to_base(model.kind_ranges, [&](auto joint, int n) {
      using J = decltype(joint);
      const BodyTopology& body = model.topology[n];
      if constexpr (is_general<J>) {
        if (tau) project_on_elements(model, body, in.q, w_[n], tau);
      } else {
        if (tau) tau[body.v] = J::project(w_[n], model.constants[n].pitch);
      }
      if (body.parent >= 0) w_[body.parent] += transpose_times(state_[n].X, w_[n]);
    });
  }

  const Model* model_;
  std::vector<BodyState<S>> state_;
  std::vector<GeneralState<S>> general_;
  std::vector<Motion<S>> a_;
  std::vector<Force<S>> w_;
};

}  // namespace linkwise
