#pragma once
// Another right-hand side for the articulated inertias at hand: D, U and Ya depend on the position
// alone, as the factors L D L^T of the joint-space mass matrix do that they stand for
// [rodriguez1987]. Only bias wrenches go inward,
//     p_n = bias + sum X_k^T pa_k,   u = tau - P^T p_n,   pa = p_n + Ya c + U D^-1 u,
// and the outward sweep is that of a first evaluation.
#include "linkwise/dynamics/articulated_body.hpp"

namespace linkwise {

template <class S>
void ArticulatedBody<S>::evaluate_again(const SweepInput<S>& in, S* du, S* loads) {
  if (in.v)
    calc_velocities<true>(in, model_->kind_ranges);
  else
    rest(in);
  add_external(in);
  tip_to_base_again(in);
  base_to_tip<true>(in, model_->kind_ranges, du);
  store_loads(in, loads);
}

template <class S>
void ArticulatedBody<S>::rest(const SweepInput<S>& in) {
  for (int n = 0; n < model_->n_bodies(); ++n) {
    body_[n].v = {};
    body_[n].p = {};
    const BodyTopology& body = model_->topology[n];
    if (body.kind != BodyKind::general) continue;
    GeneralWork& general = general_body_[body.general];
    BodyState<S> state;
    if (in.prescribed && !general.free)
      calc_general_state(*model_, body, in, body_[n].v, state, general_[body.general]);
    general.c = state.c;
  }
}

template <class S>
void ArticulatedBody<S>::tip_to_base_again(const SweepInput<S>& in) {
  const Model& model = *model_;
  for_kind_ranges_tip_to_base(model, [&](auto joint, int begin, int end) {
    using J = decltype(joint);
    for (int n = end - 1; n >= begin; --n) {
      const BodyTopology& body = model.topology[n];
      const BodyConstants<double>& k = model.constants[n];
      BodyWork& w = body_[n];
      Eliminated& e = eliminated_[n];
      Force<S> p = w.p;
      if constexpr (is_general<J>) {
        const GeneralState<S>& g = general_[body.general];
        GeneralWork& own = general_body_[body.general];
        if (own.free) {
          const Force<S> known = to_force(in.tau + body.v);
          Force<S> f = known;
          f -= p;
          own.a = solve(own.L, f);
          p = known;
        } else {
          S y[6];
          for (int i = 0; i < g.n; ++i) y[i] = own.u[i] = in.tau[g.dof[i]] - dot(g.P[i], p);
          solve_general(g.n, own, y);
          p += e.Y * own.c;
          for (int i = 0; i < g.n; ++i) p += Force<S>{y[i] * own.U[i].lin, y[i] * own.U[i].ang};
        }
      } else {
        const S u = in.tau[body.v] - J::project(p, k.pitch);
        w.u = u;
        if (in.v) {
          const Motion<S> c = J::bias(w.v, k.pitch, in.v[body.v]);
          if constexpr (J::leaves_zero_row)
            p += planar(e) * c;
          else
            p += e.Y * c;
        }
        const S rate = w.D_inverse * u;
        p += Force<S>{rate * w.U.lin, rate * w.U.ang};
      }
      store(e.p, p);
      if (body.parent < 0) continue;
      Force<S>& p_parent = body_[body.parent].p;
      if constexpr (std::is_same_v<J, HingeJoint>)
        p_parent += to_parent(placement(k), w.cosine, w.sine, p);
      else
        p_parent += transpose_times(pose_[n], p);
    }
  });
}

}  // namespace linkwise
