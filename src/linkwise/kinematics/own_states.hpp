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

/// Place of the first coordinate of body n's own in v.
inline int own_place(const Model& model, int n) { return model.elements[model.own_element[n]].v; }

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
  if (model.own_element.empty() || model.own_element[n] < 0) return;
  with_body(model, n, [&](const auto& body) {
    if constexpr (has_coordinates<std::remove_cvref_t<decltype(body)>>)
      f(body, own_state(model, in, n));
  });
}

/// Does a body's joint carry it on an elastic body's port?
inline bool on_port(const Model& model, const BodyTopology& body) {
  return model.elements[body.first_element].kind == ElementKind::elastic;
}

}  // namespace linkwise
