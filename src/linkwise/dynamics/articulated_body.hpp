#pragma once
// Articulated-body recursion [featherstone1983; featherstone2008, ch. 7] for trees and every
// joint:
//     Y_n = M_n + sum X_k^T Ya_k X_k,  U = Y P,  D = P^T U + armature,  u = tau - P^T p
//     Ya = Y - U D^-1 U^T,  pa = p + Ya c + U D^-1 u;   du = D^-1 (u - U^T (X a_p + c))
// Ours differs in the joint frame along z, which makes U a column and D a number for one-axis
// joints, in packed storage, and in running on lanes. The joint loads cost one more inward sweep.
#include <vector>

#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

template <class S>
class ArticulatedBody {
 public:
  explicit ArticulatedBody(const Model& model)
      : model_(&model),
        state_(model.n_bodies()),
        body_(model.n_bodies()),
        general_(model.n_general),
        general_body_(model.n_general) {}

  /// du [nv]; loads [n_joints][6] or null. Returns false when some D is not positive definite:
  /// `failed_body`.
  bool evaluate(const SweepInput<S>& in, S* du, S* loads) {
    calc_body_states(*model_, in, state_.data(), general_.data());
    failed_body_ = -1;
    tip_to_base(in);
    base_to_tip(in, du);
    if (loads) calc_loads(in.q, loads);
    return failed_body_ < 0;
  }

  int failed_body() const { return failed_body_; }
  const std::vector<BodyState<S>>& states() const { return state_; }

 private:
  struct BodyWork {
    ArticulatedInertia<S> Y;  ///< children's share, then unused
    Force<S> p;               ///< children's share, then unused
    Force<S> U;               ///< one-axis joints: Y P; all: later M a + bias, then the joint load
    S D_inverse, u;
    Motion<S> a;
  };
  struct GeneralWork {
    Force<S> U[6];
    S L[36];  ///< Cholesky factor of D, reciprocal diagonal
    S u[6];
  };

  LW_INLINE void give_to_parent(int n, const BodyTopology& body, const ArticulatedInertia<S>& Ya,
                                const Force<S>& pa) {
    const Transform<S>& X = state_[n].X;
    BodyWork& parent = body_[body.parent];
    const ArticulatedInertia<S> Y = transform_to_parent(X, Ya);
    const Force<S> p = transpose_times(X, pa);
    if (body.first_to_give) {
      parent.Y = Y;
      parent.p = p;
    } else {
      parent.Y += Y;
      parent.p += p;
    }
  }

  void tip_to_base(const SweepInput<S>& in) {
    const Model& model = *model_;
    for_runs_tip_to_base(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = end - 1; n >= begin; --n) {
        const BodyTopology& body = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        const BodyState<S>& s = state_[n];
        BodyWork& w = body_[n];
        ArticulatedInertia<S> Y{};
        Force<S> p = s.bias;
        if (body.n_children > 0) {
          Y = w.Y;
          p += w.p;
        }
        add_inertia(Y, k.inertia);
        if constexpr (is_general<J>) {
          eliminate_general(in, n, body, Y, p);
        } else {
          const Force<S> U = J::column(Y, k.pitch);
          const S D = J::project(U, k.pitch) + k.armature;
          check(D, n);
          const S D_inverse = 1.0 / D;
          const S u = in.tau[body.v] - J::project(p, k.pitch);
          w.U = U;
          w.D_inverse = D_inverse;
          w.u = u;
          if (body.parent < 0) continue;
          const Force<S> V{D_inverse * U.lin, D_inverse * U.ang};
          subtract_outer(Y, V, U);
          p += Y * s.c;
          p += Force<S>{u * V.lin, u * V.ang};
          give_to_parent(n, body, Y, p);
        }
      }
    });
  }

  LW_INLINE void check(S D, int n) {
    for (int i = 0; i < lane_count<S>; ++i)
      if (__builtin_expect(!(lane(D, i) > 0), 0)) failed_body_ = n;
  }

  void eliminate_general(const SweepInput<S>& in, int n, const BodyTopology& body,
                         ArticulatedInertia<S>& Y, Force<S>& p) {
    const GeneralState<S>& g = general_[body.general];
    GeneralWork& w = general_body_[body.general];
    const auto& armature = model_->dof_values(DofProperty::armature);
    for (int i = 0; i < g.n; ++i) w.U[i] = Y * g.P[i];
    // Cholesky of D = P^T U + armature, rows of L with the reciprocal diagonal.
    for (int i = 0; i < g.n; ++i) {
      for (int j = 0; j <= i; ++j) {
        S d = dot(g.P[i], w.U[j]);
        if (i == j) d = d + armature[g.dof[i]];
        for (int l = 0; l < j; ++l) d = d - w.L[6 * i + l] * w.L[6 * j + l];
        if (i == j) {
          check(d, n);
          w.L[7 * i] = 1.0 / square_root(d);
        } else {
          w.L[6 * i + j] = d * w.L[7 * j];
        }
      }
      w.u[i] = in.tau[g.dof[i]] - dot(g.P[i], p);
    }
    if (body.parent < 0) return;
    // W = U L^-T, so that U D^-1 U^T = W W^T and U D^-1 u = W (L^-1 u).
    Force<S> W[6];
    S z[6];
    for (int i = 0; i < g.n; ++i) {
      Force<S> column = w.U[i];
      S y = w.u[i];
      for (int l = 0; l < i; ++l) {
        column -= Force<S>{w.L[6 * i + l] * W[l].lin, w.L[6 * i + l] * W[l].ang};
        y = y - w.L[6 * i + l] * z[l];
      }
      const S r = w.L[7 * i];
      W[i] = {r * column.lin, r * column.ang};
      z[i] = r * y;
      subtract_outer(Y, W[i], W[i]);
    }
    p += Y * state_[n].c;
    for (int i = 0; i < g.n; ++i) p += Force<S>{z[i] * W[i].lin, z[i] * W[i].ang};
    give_to_parent(n, body, Y, p);
  }

  void base_to_tip(const SweepInput<S>& in, S* du) {
    const Model& model = *model_;
    const Motion<S> ground = ground_acceleration<S>(model, in.gravity_factor);
    for_runs_base_to_tip(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& body = model.topology[n];
        const BodyState<S>& s = state_[n];
        BodyWork& w = body_[n];
        Motion<S> a = s.X * (body.parent >= 0 ? body_[body.parent].a : ground);
        a += s.c;
        if constexpr (is_general<J>) {
          accelerate_general(in, body, a, du);
        } else {
          const S rate = w.D_inverse * (w.u - dot(a, w.U));
          du[body.v] = rate;
          J::add_rate(a, model.constants[n].pitch, rate);
        }
        w.a = a;
      }
    });
  }

  void accelerate_general(const SweepInput<S>& in, const BodyTopology& body, Motion<S>& a, S* du) {
    const GeneralState<S>& g = general_[body.general];
    const GeneralWork& w = general_body_[body.general];
    S y[6];
    for (int i = 0; i < g.n; ++i) {
      S t = w.u[i] - dot(a, w.U[i]);
      for (int l = 0; l < i; ++l) t = t - w.L[6 * i + l] * y[l];
      y[i] = t * w.L[7 * i];
    }
    for (int i = g.n - 1; i >= 0; --i) {
      S t = y[i];
      for (int l = i + 1; l < g.n; ++l) t = t - w.L[6 * l + i] * y[l];
      y[i] = t * w.L[7 * i];
    }
    for (int i = 0; i < g.n; ++i) {
      du[g.dof[i]] = y[i];
      a += Motion<S>{y[i] * g.P[i].lin, y[i] * g.P[i].ang};
    }
    copy_prescribed(*model_, body, in, du);
  }

  void calc_loads(const S* q, S* loads) {
    const Model& model = *model_;
    for (int n = 0; n < model.n_bodies(); ++n) {
      body_[n].U = model.constants[n].inertia * body_[n].a;
      body_[n].U += state_[n].bias;
    }
    for (int n = model.n_bodies() - 1; n >= 0; --n)
      if (const int parent = model.topology[n].parent; parent >= 0)
        body_[parent].U += transpose_times(state_[n].X, body_[n].U);
    store_joint_loads(
        model, q, [&](int n) -> const Force<S>& { return body_[n].U; }, loads);
  }

  const Model* model_;
  std::vector<BodyState<S>> state_;
  std::vector<BodyWork> body_;
  std::vector<GeneralState<S>> general_;
  std::vector<GeneralWork> general_body_;
  int failed_body_ = -1;
};

}  // namespace linkwise
