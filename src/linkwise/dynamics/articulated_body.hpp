#pragma once
// Articulated-body recursion [featherstone1983; featherstone2008, ch. 7] for trees and every joint:
//     Y_n = M_n + sum X_k^T Ya_k X_k,  U = Y P,  D = P^T U + armature,  u = tau - P^T p
//     Ya = Y - U D^-1 U^T,  pa = p + Ya c + U D^-1 u;   du = D^-1 (u - U^T (X a_p + c))
// Ours differs in the joint frame along z, which makes U a column and D a number for one-axis
// joints, in the placements of hinges (hinge.hpp) with the zeros that their elimination leaves, and
// in running on lanes. The joint load falls out of the outward sweep: w_n = Ya X a_p + pa.
#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "linkwise/exec/thread_pool.hpp"
#include "linkwise/kinematics/axis_frames.hpp"
#include "linkwise/kinematics/body_state.hpp"
#include "linkwise/kinematics/branches.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

template <class S>
class ArticulatedBody {
 public:
  explicit ArticulatedBody(const Model& model)
      : model_(&model),
        body_(model.n_bodies()),
        general_(model.n_general),
        general_body_(model.n_general) {
    const auto& armature = model.dof_values(DofProperty::armature);
    for (const BodyTopology& body : model.topology) {
      if (body.kind != BodyKind::general || !is_free(model, body)) continue;
      const auto rotors = armature.begin() + body.v;
      general_body_[body.general].free = std::count(rotors, rotors + 6, 0.0) == 6;
    }
    bool hinges_only = true;
    for (const KindRange& range : model.kind_ranges)
      hinges_only &= range.kind == BodyKind::hinge || range.end == 1;
    pose_.resize(hinges_only ? 1 : model.n_bodies());
  }

  /// du [nv]; loads [n_joints][6] or null. Returns false when some D is not positive definite:
  /// `failed_body`.
  bool evaluate(const SweepInput<S>& in, S* du, S* loads) {
    start(loads);
    if (branches_ && branches_->any()) {
      evaluate_branches(in, du, loads);
    } else {
      calc_velocities(in, model_->kind_ranges);
      add_external(in);
      tip_to_base(in, model_->kind_ranges, loads);
      base_to_tip(in, model_->kind_ranges, du, loads);
    }
    if (loads) store_loads(in, loads);
    return failed_body_ < 0;
  }

  /// The same for another right-hand side at the q of the last evaluate(), which succeeded and was
  /// asked for loads: with its factors, at half of its cost.
  void evaluate_again(const SweepInput<S>& in, S* du, S* loads);

  int failed_body() const { return failed_body_; }

  /// From now on the branches of a large tree are shared by threads, which influence no result.
  void share_branches(int threads) {
    branches_ = std::make_unique<Branches>(*model_);
    threads_ = threads;
    if (!branches_->any()) return;
    given_of_.assign(model_->n_bodies(), -1);
    for (const KindRange& range : branches_->trunk)
      for (int n = range.begin; n < range.end; ++n) only_add(n);
    for (const auto& share : branches_->shares)
      for (const int root : share.roots)
        if (model_->topology[root].parent >= 0) {
          given_of_[root] = static_cast<int>(given_.size());
          given_.push_back({});
        }
  }

  struct BodyWork {
    Motion<S> v;              ///< velocity, then acceleration
    Force<S> p;               ///< bias wrench, children's share added tip to base
    ArticulatedInertia<S> Y;  ///< children's share
    Force<S> U;               ///< one-axis joints: Y P
    S D_inverse, u, cosine, sine;
  };

  /// The sweeps one by one over some of the bodies, for whoever takes care of the others: their v,
  /// Y, p and joint loads are then read from here and left here.
  BodyWork& body(int n) { return body_[n]; }
  const BodyWork& body(int n) const { return body_[n]; }
  /// From now on body n adds to its parent's Y, which the caller clears, and never sets it.
  void only_add(int n) {
    given_of_.resize(model_->n_bodies(), -1);
    given_of_[n] = adds;
  }
  void start(const S* loads) {
    failed_body_ = -1;
    if (loads && eliminated_.empty()) eliminated_.resize(model_->n_bodies());
  }
  /// `again`: at the position of the last call.
  template <bool again = false>
  void calc_velocities(const SweepInput<S>& in, const std::vector<KindRange>& ranges) {
    const Model& model = *model_;
    const Motion<S> resting{};
    for_kind_ranges_base_to_tip(ranges, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& body = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        BodyWork& w = body_[n];
        const Motion<S>& v_parent = body.parent >= 0 ? body_[body.parent].v : resting;
        if constexpr (is_general<J>) {
          GeneralWork& general = general_body_[body.general];
          if (general.free) {
            calc_free(in, n, body, v_parent);
          } else {
            BodyState<S> state;
            calc_general_state(model, body, in, v_parent, state, general_[body.general]);
            pose_[n] = state.X;
            w.v = state.v;
            general.c = state.c;
          }
        } else {
          if constexpr (again)
            ;
          else if constexpr (J::is_hinge)
            sincos(S(in.q[body.q] + k.theta), w.sine, w.cosine);
          else
            pose_[n] = J::pose(k.tree, k.pitch, in.q[body.q]);
          Motion<S> v = seen_at_child<J>(n, v_parent);
          J::add_rate(v, k.pitch, in.v ? in.v[body.v] : S{});
          store(w.v, v);
        }
        w.p = cross_dual(w.v, k.inertia * w.v);
      }
    });
  }

  void add_external(const SweepInput<S>& in) {
    if (!in.external) return;
    for (int j = 0; j < model_->n_joints(); ++j)
      if (model_->joints[j].last_of_body)
        body_[model_->joints[j].body].p -= user_wrench(in.external, model_->joints[j], j);
  }
  void tip_to_base(const SweepInput<S>& in, const std::vector<KindRange>& ranges, const S* loads) {
    if (loads)
      tip_to_base<true>(in, ranges);
    else
      tip_to_base<false>(in, ranges);
  }
  void base_to_tip(const SweepInput<S>& in, const std::vector<KindRange>& ranges, S* du,
                   const S* loads) {
    if (loads)
      base_to_tip<true>(in, ranges, du);
    else
      base_to_tip<false>(in, ranges, du);
  }
  Force<S>& joint_load(int n) { return eliminated_[n].p; }
  void store_loads(const SweepInput<S>& in, S* loads) const {
    store_joint_loads(
        *model_, in.q, [&](int n) -> const Force<S>& { return eliminated_[n].p; }, loads);
  }
  /// Of several the outermost is named, whichever thread finds one first.
  void fail(int n) {
    int known = failed_body_;
    while (known < n && !failed_body_.compare_exchange_weak(known, n)) {
    }
  }

 private:
  static constexpr double smallest_pivot = 1e-13;
  static constexpr int adds = -2;
  /// What the joint load needs: w = Ya x + pa for the parent's acceleration x seen at the body.
  struct Eliminated {
    ArticulatedInertia<S> Y;
    Force<S> p;  ///< in the end the joint load
  };
  struct GeneralWork {
    bool free = false;  ///< a floating joint without rotors: P = 1
    Motion<S> c;
    Motion<S> a;  ///< of a free body: Y^-1 (tau - p), its acceleration
    Force<S> U[6];
    S L[36];  ///< Cholesky factor of D, reciprocal diagonal
    S u[6];
  };

  template <class J>
  LW_INLINE Motion<S> seen_at_child(int n, const Motion<S>& v) const {
    if constexpr (J::is_hinge)
      return to_child(placement(model_->constants[n]), body_[n].cosine, body_[n].sine, v);
    else
      return pose_[n] * v;
  }

  /// Trunk and branches [hwang1988]; what the branches give to the trunk is added in their order.
  void evaluate_branches(const SweepInput<S>& in, S* du, S* loads) {
    const auto each = [&](auto&& sweep) {
      const auto task = [&](int i) { sweep(branches_->shares[i].kind_ranges); };
      parallel_for(static_cast<int>(branches_->shares.size()), threads_, std::ref(task));
    };
    calc_velocities(in, branches_->trunk);
    each([&](const std::vector<KindRange>& ranges) { calc_velocities(in, ranges); });
    add_external(in);
    each([&](const std::vector<KindRange>& ranges) { tip_to_base(in, ranges, loads); });
    for (const KindRange& range : branches_->trunk)
      for (int n = range.begin; n < range.end; ++n) body_[n].Y = {};
    for (const auto& share : branches_->shares)
      for (const int root : share.roots)
        if (given_of_[root] >= 0) {
          BodyWork& parent = body_[model_->topology[root].parent];
          parent.Y += given_[given_of_[root]].Y;
          parent.p += given_[given_of_[root]].p;
        }
    tip_to_base(in, branches_->trunk, loads);
    base_to_tip(in, branches_->trunk, du, loads);
    each([&](const std::vector<KindRange>& ranges) { base_to_tip(in, ranges, du, loads); });
  }

  LW_INLINE void give_to_parent(int n, const BodyTopology& body, const ArticulatedInertia<S>& Y,
                                const Force<S>& p) {
    if (__builtin_expect(!given_of_.empty(), 0)) return give_among_branches(n, body, Y, p);
    BodyWork& parent = body_[body.parent];
    if (body.first_to_give)
      parent.Y = Y;
    else
      parent.Y += Y;
    parent.p += p;
  }

  void give_among_branches(int n, const BodyTopology& body, const ArticulatedInertia<S>& Y,
                           const Force<S>& p) {
    if (given_of_[n] >= 0) {
      given_[given_of_[n]] = {Y, p};
      return;
    }
    BodyWork& parent = body_[body.parent];
    // To a body of the trunk the branches have given before.
    if (body.first_to_give && given_of_[n] != adds)
      parent.Y = Y;
    else
      parent.Y += Y;
    parent.p += p;
  }

  template <bool with_loads>
  void tip_to_base(const SweepInput<S>& in, const std::vector<KindRange>& ranges) {
    const Model& model = *model_;
    for_kind_ranges_tip_to_base(ranges, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = end - 1; n >= begin; --n) {
        const BodyTopology& body = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        BodyWork& w = body_[n];
        ArticulatedInertia<S> Y{};
        if (body.n_children > 0) Y = w.Y;
        add_inertia(Y, k.inertia);
        if constexpr (is_general<J>) {
          if (general_body_[body.general].free)
            eliminate_free<with_loads>(in, n, body, Y);
          else
            eliminate_general<with_loads>(in, n, body, Y);
        } else {
          const Force<S> U = J::column(Y, k.pitch);
          S D = J::project(U, k.pitch);
          if constexpr (!J::leaves_zero_row) D = D + k.armature;
          check(D, n);
          const S D_inverse = 1.0 / D;
          const S u = in.tau[body.v] - J::project(w.p, k.pitch);
          store(w.U, U);
          w.D_inverse = D_inverse;
          w.u = u;
          if (!with_loads && body.parent < 0) continue;
          const Force<S> V{D_inverse * U.lin, D_inverse * U.ang};
          const Motion<S> c = J::bias(w.v, k.pitch, in.v ? in.v[body.v] : S{});
          if constexpr (J::leaves_zero_row)
            eliminate_planar<J, with_loads>(n, body, Y, U, V, c, u);
          else
            eliminate<with_loads>(n, body, Y, U, V, c, u);
        }
      }
    });
  }

  template <bool with_loads>
  LW_INLINE void eliminate(int n, const BodyTopology& body, ArticulatedInertia<S>& Y,
                           const Force<S>& U, const Force<S>& V, const Motion<S>& c, S u) {
    subtract_outer(Y, V, U);
    Force<S> p = body_[n].p;
    p += Y * c;
    p += Force<S>{u * V.lin, u * V.ang};
    if constexpr (with_loads) eliminated_[n] = {Y, p};
    if (body.parent >= 0)
      give_to_parent(n, body, transform_to_parent(pose_[n], Y), transpose_times(pose_[n], p));
  }

  template <class J, bool with_loads>
  LW_INLINE void eliminate_planar(int n, const BodyTopology& body, const ArticulatedInertia<S>& Y,
                                  const Force<S>& U, const Force<S>& V, const Motion<S>& c, S u) {
    PlanarInertia<S> Z;
    Force<S> p = body_[n].p;
    eliminate_turn(Y, U, V, c, u, Z, p);
    if constexpr (with_loads) {
      Eliminated& e = eliminated_[n];
      e.Y.A = Z.A;
#pragma GCC unroll 6
      for (int i = 0; i < 6; ++i) e.Y.B.m[i] = Z.B[i];
      e.Y.C.m[0] = Z.xx;
      e.Y.C.m[1] = Z.xy;
      e.Y.C.m[2] = Z.yy;
      store(e.p, p);
    }
    if (body.parent < 0) return;
    if constexpr (J::is_hinge) {
      const auto k = placement(model_->constants[n]);
      give_to_parent(n, body, to_parent(k, body_[n].cosine, body_[n].sine, Z),
                     to_parent(k, body_[n].cosine, body_[n].sine, p));
    } else {
      give_to_parent(n, body, transform_to_parent(pose_[n], Z), transpose_times(pose_[n], p));
    }
  }

  LW_INLINE void check(S D, int n) {
    for (int i = 0; i < lane_count<S>; ++i)
      if (__builtin_expect(!(lane(D, i) > 0), 0)) fail(n);
  }

  void calc_free(const SweepInput<S>& in, int n, const BodyTopology& body,
                 const Motion<S>& v_parent) {
    pose_[n] = element_pose(model_->elements[body.first_element], in.q);
    Motion<S> v = pose_[n] * v_parent, relative{};
    if (in.v) relative = to_motion(in.v + body.v);
    v += relative;
    general_body_[body.general].c = cross(v, relative);
    body_[n].v = v;
  }

  /// D = Y, and the parent feels nothing but the joint's own forces.
  template <bool with_loads>
  void eliminate_free(const SweepInput<S>& in, int n, const BodyTopology& body,
                      const ArticulatedInertia<S>& Y) {
    GeneralWork& w = general_body_[body.general];
    if (!factor(Y, w.L, smallest_pivot)) fail(n);
    const Force<S> known = to_force(in.tau + body.v);
    Force<S> f = known;
    f -= body_[n].p;
    w.a = solve(w.L, f);
    if constexpr (with_loads) eliminated_[n] = {{}, known};
    if (body.parent >= 0) give_to_parent(n, body, {}, transpose_times(pose_[n], known));
  }

  void accelerate_free(const BodyTopology& body, Motion<S>& a, S* du) {
    const GeneralWork& w = general_body_[body.general];
    a += w.c;
    const Vector6<S> carried = to_array(a), whole = to_array(w.a);
    for (int i = 0; i < 6; ++i) du[body.v + i] = whole[i] - carried[i];
    a = w.a;
  }

  template <bool with_loads>
  void eliminate_general(const SweepInput<S>& in, int n, const BodyTopology& body,
                         ArticulatedInertia<S>& Y) {
    const GeneralState<S>& g = general_[body.general];
    GeneralWork& w = general_body_[body.general];
    Force<S> p = body_[n].p;
    const auto& armature = model_->dof_values(DofProperty::armature);
    for (int i = 0; i < g.n; ++i) w.U[i] = Y * g.P[i];
    // Cholesky of D = P^T U + armature, rows of L with the reciprocal diagonal.
    for (int i = 0; i < g.n; ++i) {
      for (int j = 0; j <= i; ++j) {
        S d = dot(g.P[i], w.U[j]);
        if (i == j) d = d + armature[g.dof[i]];
        const S whole = d;
        for (int l = 0; l < j; ++l) d = d - w.L[6 * i + l] * w.L[6 * j + l];
        if (i == j) {
          // Two columns that move the body alike leave rounding noise here, not zero.
          check(S(d - smallest_pivot * whole), n);
          w.L[7 * i] = 1.0 / square_root(d);
        } else {
          w.L[6 * i + j] = d * w.L[7 * j];
        }
      }
      w.u[i] = in.tau[g.dof[i]] - dot(g.P[i], p);
    }
    if (!with_loads && body.parent < 0) return;
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
    p += Y * w.c;
    for (int i = 0; i < g.n; ++i) p += Force<S>{z[i] * W[i].lin, z[i] * W[i].ang};
    if constexpr (with_loads) eliminated_[n] = {Y, p};
    if (body.parent >= 0)
      give_to_parent(n, body, transform_to_parent(pose_[n], Y), transpose_times(pose_[n], p));
  }

  template <bool with_loads>
  void base_to_tip(const SweepInput<S>& in, const std::vector<KindRange>& ranges, S* du) {
    const Model& model = *model_;
    const Motion<S> ground = ground_acceleration<S>(model, in.gravity_factor);
    for_kind_ranges_base_to_tip(ranges, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& body = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        BodyWork& w = body_[n];
        const Motion<S>& a_parent = body.parent >= 0 ? body_[body.parent].v : ground;
        if constexpr (is_general<J>) {
          Motion<S> a = pose_[n] * a_parent;
          if constexpr (with_loads) eliminated_[n].p = load(n, a);
          const GeneralWork& general = general_body_[body.general];
          if (general.free) {
            accelerate_free(body, a, du);
          } else {
            a += general.c;
            accelerate_general(in, body, a, du);
          }
          w.v = a;
        } else {
          Motion<S> a = seen_at_child<J>(n, a_parent);
          Force<S> joint_load;
          if constexpr (with_loads) {
            if constexpr (J::leaves_zero_row)
              joint_load = planar_load(n, a);
            else
              joint_load = load(n, a);
          }
          a += J::bias(w.v, k.pitch, in.v ? in.v[body.v] : S{});
          const S rate = w.D_inverse * (w.u - dot(a, w.U));
          du[body.v] = rate;
          J::add_rate(a, k.pitch, rate);
          store(w.v, a);
          if constexpr (with_loads) store(eliminated_[n].p, joint_load);
        }
      }
    });
  }

  LW_INLINE Force<S> load(int n, const Motion<S>& a) const {
    Force<S> w = eliminated_[n].Y * a;
    w += eliminated_[n].p;
    return w;
  }
  LW_INLINE Force<S> planar_load(int n, const Motion<S>& a) const {
    Force<S> w = planar(eliminated_[n]) * a;
    w += eliminated_[n].p;
    return w;
  }
  LW_INLINE static PlanarInertia<S> planar(const Eliminated& e) {
    PlanarInertia<S> Z;
    Z.A = e.Y.A;
#pragma GCC unroll 6
    for (int i = 0; i < 6; ++i) Z.B[i] = e.Y.B.m[i];
    Z.xx = e.Y.C.m[0];
    Z.xy = e.Y.C.m[1];
    Z.yy = e.Y.C.m[2];
    return Z;
  }

  void accelerate_general(const SweepInput<S>& in, const BodyTopology& body, Motion<S>& a, S* du) {
    const GeneralState<S>& g = general_[body.general];
    const GeneralWork& w = general_body_[body.general];
    S y[6];
    for (int i = 0; i < g.n; ++i) y[i] = w.u[i] - dot(a, w.U[i]);
    solve_general(g.n, w, y);
    for (int i = 0; i < g.n; ++i) {
      du[g.dof[i]] = y[i];
      a += Motion<S>{y[i] * g.P[i].lin, y[i] * g.P[i].ang};
    }
    copy_prescribed(*model_, body, in, du);
  }

  /// D^-1 y.
  static void solve_general(int n, const GeneralWork& w, S* y) {
    for (int i = 0; i < n; ++i) {
      for (int l = 0; l < i; ++l) y[i] = y[i] - w.L[6 * i + l] * y[l];
      y[i] = y[i] * w.L[7 * i];
    }
    for (int i = n - 1; i >= 0; --i) {
      for (int l = i + 1; l < n; ++l) y[i] = y[i] - w.L[6 * l + i] * y[l];
      y[i] = y[i] * w.L[7 * i];
    }
  }

  void rest(const SweepInput<S>& in);
  void tip_to_base_again(const SweepInput<S>& in);

  const Model* model_;
  std::vector<BodyWork> body_;
  std::vector<Transform<S>> pose_;      ///< of bodies that are no hinges
  std::vector<Eliminated> eliminated_;  ///< made when loads are first asked for
  std::vector<GeneralState<S>> general_;
  std::vector<GeneralWork> general_body_;
  std::atomic<int> failed_body_ = -1;
  std::unique_ptr<Branches> branches_;  ///< made where threads may share them
  int threads_ = 1;
  std::vector<int> given_of_;      ///< root of a branch -> index into given_; or adds; else -1
  std::vector<Eliminated> given_;  ///< to the trunk
};

}  // namespace linkwise

#include "linkwise/dynamics/articulated_response.hpp"
