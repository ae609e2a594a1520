#pragma once
// What sweeps ask of bodies, whether or not their kind has coordinates of its own. For kinds
// without any, these are the functions of the body itself.
#include "linkwise/kinematics/sweep_input.hpp"
#include "linkwise/model/model.hpp"

namespace linkwise {

/// Of body n, whose kind has coordinates.
template <class S>
LW_INLINE OwnState<S> own_state(const Model& model, const SweepInput<S>& in, int n) {
  const Element& first = model.elements[model.own_element[n]];
  return {in.q + first.q, in.v ? in.v + first.v : nullptr, in.tau ? in.tau + first.v : nullptr};
}

/// f(body), with the body's own state behind it where its kind has one.
template <class B, class S, class F>
LW_INLINE decltype(auto) with_own_state(const B& body, const Model& model, const SweepInput<S>& in,
                                        int n, F&& f) {
  if constexpr (has_coordinates<B>)
    return f(body, own_state(model, in, n));
  else
    return f(body);
}

/// f(body n, its own state) where its kind has one; nothing otherwise.
template <class S, class F>
LW_INLINE void where_coordinates(const Model& model, const SweepInput<S>& in, int n, F&& f) {
  if constexpr (BodyKinds::any_coordinates)
    with_body(model, n, [&](const auto& body) {
      if constexpr (has_coordinates<std::remove_cvref_t<decltype(body)>>)
        f(body, own_state(model, in, n));
    });
}

/// The wrench that body n takes without acceleration of its frame, its coordinates eliminated.
template <class B, class S>
LW_INLINE Force<S> condensed_bias(const B& body, const Model& model, const SweepInput<S>& in, int n,
                                  const Motion<S>& v) {
  if constexpr (has_coordinates<B>)
    return condense(body, v, own_state(model, in, n)).p;
  else
    return momentum_bias(body, v);
}

/// Adds what an acceleration of its frame takes then.
template <class B, class S>
LW_INLINE void add_condensed(ArticulatedInertia<S>& Y, const B& body, const Model& model,
                             const SweepInput<S>& in, int n, const Motion<S>& v) {
  if constexpr (has_coordinates<B>)
    Y += condense(body, v, own_state(model, in, n)).M;
  else
    add_inertia(Y, body);
}

}  // namespace linkwise
