#pragma once
// The outward pass that every method starts with: for each body the transform from its parent,
// velocity, velocity-dependent acceleration c and bias wrench
//     X_n,  v_n = X_n v_p + P_n u_n,  c_n = v_n x (P_n u_n) + ...,
//     p_n = v_n x* (M_n v_n) - external
// A stack of elements is walked as if its frames were massless bodies, which gives c_n and the
// columns of P_n in the body's frame without ever forming dP/dt [featherstone2008, ch. 4].
#include <span>
#include <utility>

#include "linkwise/kinematics/sweep_input.hpp"
#include "linkwise/kinematics/user_frames.hpp"
#include "linkwise/model/model.hpp"

namespace linkwise {

template <class S>
struct BodyState {
  Transform<S> X;
  Motion<S> v, c;
  Force<S> bias;
};

/// Motion subspace of a body whose joint is not one plain axis. Prescribed elements are no columns:
/// their given acceleration is part of c.
template <class S>
struct GeneralState {
  int n = 0;   ///< free degrees of freedom
  int dof[6];  ///< their indices in v
  Motion<S> P[6];
};

/// Calls f(joint, begin, end) for every range of bodies with equal joints; joint is one of the
/// structs of axis_joints.hpp or GeneralJoint. One dispatch per range, none per body.
struct GeneralJoint {
  static constexpr bool is_hinge = false, leaves_zero_row = false;
};
template <class F>
LW_INLINE void dispatch_kind_range(const KindRange& range, F&& f) {
  switch (range.joint_kind) {
    case JointKind::hinge:
      return f(HingeJoint{}, range.begin, range.end);
    case JointKind::revolute:
      return f(RevoluteJoint{}, range.begin, range.end);
    case JointKind::geared:
      return f(GearedJoint{}, range.begin, range.end);
    case JointKind::prismatic:
      return f(PrismaticJoint{}, range.begin, range.end);
    case JointKind::helical:
      return f(HelicalJoint{}, range.begin, range.end);
    case JointKind::general:
      return f(GeneralJoint{}, range.begin, range.end);
  }
}
template <class J>
inline constexpr bool is_general = std::is_same_v<J, GeneralJoint>;

/// Calls f(joint, bodies, begin, end), where bodies[n] is a body of a kind known while compiling.
template <class F>
LW_INLINE void dispatch_bodies(const Model& model, const KindRange& range, F&& f) {
  dispatch_kind_range(range, [&](auto joint, int begin, int end) {
    BodyKinds::dispatch(range.body_kind, [&](auto kind) {
      f(joint, BodiesOfKind<typename decltype(kind)::Body>{model}, begin, end);
    });
  });
}

/// f(joint, n) for the bodies of some ranges; with the model at hand f(joint, n, body n).
template <class F>
LW_INLINE void for_bodies_base_to_tip(const std::vector<KindRange>& ranges, F&& f) {
  for (const KindRange& range : ranges)
    dispatch_kind_range(range, [&](auto joint, int begin, int end) {
      for (int n = begin; n < end; ++n) f(joint, n);
    });
}
template <class F>
LW_INLINE void for_bodies_tip_to_base(const std::vector<KindRange>& ranges, F&& f) {
  for (size_t i = ranges.size(); i-- > 0;)
    dispatch_kind_range(ranges[i], [&](auto joint, int begin, int end) {
      for (int n = end - 1; n >= begin; --n) f(joint, n);
    });
}

template <class F>
LW_INLINE void for_bodies_base_to_tip(const Model& model, const std::vector<KindRange>& ranges,
                                      F&& f) {
  for (const KindRange& range : ranges)
    dispatch_bodies(model, range, [&](auto joint, auto bodies, int begin, int end) {
      for (int n = begin; n < end; ++n) f(joint, n, bodies[n]);
    });
}
template <class F>
LW_INLINE void for_bodies_tip_to_base(const Model& model, const std::vector<KindRange>& ranges,
                                      F&& f) {
  for (size_t i = ranges.size(); i-- > 0;)
    dispatch_bodies(model, ranges[i], [&](auto joint, auto bodies, int begin, int end) {
      for (int n = end - 1; n >= begin; --n) f(joint, n, bodies[n]);
    });
}

/// The outward loop of every recursion: step(joint, n, the parent's motion), where of(n) is the
/// motion of body n, found before, and `ground` that of the ground. By reference: a copy would be
/// loaded in wide words that the narrow stores just before it cannot be forwarded to, a stall of a
/// dozen cycles per body.
template <class S, class Of, class Step>
LW_INLINE void sweep_outward(const Model& model, const std::vector<KindRange>& ranges,
                             const Motion<S>& ground, Of&& of, Step&& step) {
  for_bodies_base_to_tip(ranges, [&](auto joint, int n) {
    const int parent = model.topology[n].parent;
    const Motion<S>& carried = parent >= 0 ? of(parent) : ground;
    step(joint, n, carried);
  });
}

/// The same with step(joint, n, body n, the parent's motion).
template <class S, class Of, class Step>
LW_INLINE void sweep_bodies_outward(const Model& model, const std::vector<KindRange>& ranges,
                                    const Motion<S>& ground, Of&& of, Step&& step) {
  for_bodies_base_to_tip(model, ranges, [&](auto joint, int n, const auto& own) {
    const int parent = model.topology[n].parent;
    const Motion<S>& carried = parent >= 0 ? of(parent) : ground;
    step(joint, n, own, carried);
  });
}

/// By body: is it the first of its siblings that a tip-to-base sweep meets?
inline std::vector<char> first_of_siblings(const Model& model) {
  std::vector<char> first(model.n_bodies(), 0), met(model.n_bodies(), 0);
  for (int n = model.n_bodies() - 1; n >= 0; --n)
    if (const int parent = model.topology[n].parent; parent >= 0)
      first[n] = !std::exchange(met[parent], 1);
  return first;
}

/// One floating joint, P = 1.
inline bool is_free(const Model& model, const BodyTopology& body) {
  const Element& e = model.elements[body.first_element];
  return body.n_elements == 1 && e.kind == ElementKind::floating && !e.prescribed;
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
    Motion<S> relative{};
    for (int k = 0; k < e.nv; ++k) {
      const Motion<S> column = element_column<S>(e, k);
      const S u = in.v ? in.v[e.v + k] : S{};
      relative += Motion<S>{u * column.lin, u * column.ang};
      if (e.prescribed) {
        const S a = in.prescribed ? in.prescribed[e.v + k] : S{};
        c += Motion<S>{a * column.lin, a * column.ang};
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
    s.bias = momentum_bias(own, s.v);
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
