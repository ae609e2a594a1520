#pragma once
// The outward pass that every method starts with: for each body the transform from its parent,
// velocity, velocity-dependent acceleration c and bias wrench
//     X_n,  v_n = X_n v_p + P_n u_n,  c_n = v_n x (P_n u_n) + ...,
//     p_n = v_n x* (M_n v_n) - external
// A stack of elements is walked as if its frames were massless bodies, which gives c_n and the
// columns of P_n in the body's frame without ever forming dP/dt [featherstone2008, ch. 4].
#include <span>

#include "linkwise/kinematics/kind_ranges.hpp"
#include "linkwise/kinematics/own_states.hpp"
#include "linkwise/kinematics/sweep_input.hpp"
#include "linkwise/kinematics/user_frames.hpp"

namespace linkwise {

template <class S>
struct BodyState {
  Transform<S> X;
  Motion<S> v, c;
  Force<S> bias;
};

/// Motion subspace of a body whose joint is not one plain axis. Prescribed elements are no columns:
/// their given acceleration is part of c. Nor are elastic ones: their coordinates are another
/// body's.
template <class S>
struct GeneralState {
  int n = 0;   ///< free degrees of freedom
  int dof[6];  ///< their indices in v
  Motion<S> P[6];
};

/// One floating joint, P = 1.
inline bool is_free(const Model& model, const BodyTopology& body) {
  const Element& e = model.elements[body.first_element];
  return body.n_elements == 1 && e.kind == ElementKind::floating && !e.prescribed;
}

/// The elastic element that a body's joint starts with: v and c take its motion.
template <class S>
LW_INLINE void carry_on_port(const Element& e, const SweepInput<S>& in, const ElasticPort<S>& port,
                             Motion<S>& v, Motion<S>& c) {
  if (!in.v) return;
  Motion<S> relative{};
  for (int k = 0; k < e.nv; ++k) relative += in.v[e.v + k] * port.P[k];
  v += relative;
  c += cross(v, relative);
  c += elastic_column_rate(*e.shape, port, in.v + e.v, relative);
}

/// Walks a stack of elements outward from a frame that moves by v_parent.
template <class S>
void calc_general_state(std::span<const Element> stack, const SweepInput<S>& in,
                        const Motion<S>& v_parent, BodyState<S>& state, GeneralState<S>& general) {
  Motion<S> v = v_parent, c{};
  general.n = 0;
  for (const Element& e : stack) {
    const Transform<S> X = element_pose(e, in.q);
    state.X = &e == stack.data() ? X : X * state.X;
    for (int k = 0; k < general.n; ++k) general.P[k] = X * general.P[k];
    v = X * v;
    c = X * c;
    if (e.kind == ElementKind::elastic) {
      ElasticPort<S> port;
      calc_elastic_port(*e.shape, in.q + e.q, port);
      carry_on_port(e, in, port, v, c);
      continue;
    }
    Motion<S> relative{};
    for (int k = 0; k < e.nv; ++k) {
      const Motion<S> column = element_column<S>(e, k);
      const S u = in.v ? in.v[e.v + k] : S{};
      relative += u * column;
      if (e.prescribed) {
        const S a = in.prescribed ? in.prescribed[e.v + k] : S{};
        c += a * column;
      } else {
        general.dof[general.n] = e.v + k;
        general.P[general.n++] = column;
      }
    }
    v += relative;
    c += cross(v, relative);
  }
  state.v = v;
  state.c = c;
}

template <class S>
void calc_general_state(const Model& model, const BodyTopology& body, const SweepInput<S>& in,
                        const Motion<S>& v_parent, BodyState<S>& state, GeneralState<S>& general) {
  const std::span<const Element> stack(model.elements.data() + body.first_element,
                                       static_cast<size_t>(body.n_elements));
  calc_general_state(stack, in, v_parent, state, general);
}

/// Fills states (and general for bodies of that kind) of the bodies in some ranges, whose parents
/// are among them. in.v may be null: resting.
template <class S>
void calc_body_states(const Model& model, const std::vector<KindRange>& ranges,
                      const SweepInput<S>& in, BodyState<S>* states, GeneralState<S>* general) {
  const auto velocity = [&](int n) -> const Motion<S>& { return states[n].v; };
  const auto step = [&](auto joint, int n, const auto& own, const Motion<S>& v_parent) {
    using J = decltype(joint);
    const BodyTopology& body = model.topology[n];
    const BodyConstants<double>& k = model.constants[n];
    BodyState<S>& s = states[n];
    if constexpr (is_general<J>) {
      calc_general_state(model, body, in, v_parent, s, general[body.general]);
    } else {
      s.X = J::pose(k.tree, k.pitch, in.q[body.q]);
      const S u = in.v ? in.v[body.v] : S{};
      Motion<S> v = s.X * v_parent;
      J::add_rate(v, k.pitch, u);
      s.c = J::bias(v, k.pitch, u);
      s.v = v;
    }
    s.bias = with_own_state(own, model, in, n, [&](const auto& it, const auto&... inside) {
      return momentum_bias(it, s.v, inside...);
    });
  };
  sweep_bodies_outward(model, ranges, Motion<S>{}, velocity, step);
}

/// The same of all bodies, and external wrenches.
template <class S>
void calc_body_states(const Model& model, const SweepInput<S>& in, BodyState<S>* states,
                      GeneralState<S>* general) {
  calc_body_states(model, model.kind_ranges, in, states, general);
  for_external_wrenches(model, in, [&](int n, const Force<S>& w) { states[n].bias -= w; });
}

/// Acceleration of the ground: uniform gravity as a_0 = -g.
template <class S>
LW_INLINE Motion<S> ground_acceleration(const Model& model, double factor) {
  return {{broadcast<S>(-factor * model.gravity.x), broadcast<S>(-factor * model.gravity.y),
           broadcast<S>(-factor * model.gravity.z)},
          {}};
}

/// The acceleration of prescribed degrees of freedom is what was given.
template <class S>
LW_INLINE void copy_prescribed(const Model& model, const BodyTopology& body,
                               const SweepInput<S>& in, S* du) {
  for (int i = 0; i < body.n_elements; ++i) {
    const Element& e = model.elements[body.first_element + i];
    if (!e.prescribed) continue;
    for (int k = 0; k < e.nv; ++k) du[e.v + k] = in.prescribed ? in.prescribed[e.v + k] : S{};
  }
}

}  // namespace linkwise
