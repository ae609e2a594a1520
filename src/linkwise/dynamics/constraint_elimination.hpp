#pragma once
// The constraint-force system A f = b of [sharf1993] assembled and eliminated in one sweep from tip
// to base: block Cholesky whose blocks never leave the registers, on scalars or lanes.
//
// This file has the order of the sweep and what is kept of every body;
// recursion/constraint_steps.hpp says what is done with one.
//
// A body answers a wrench r of its inboard joint, all its outboard joints eliminated, with
//     a_n = Phi_n r + alpha_n.
// Joint n on parent p, which answers with Phi' and alpha' before n is eliminated, has the rows
//     S = B^T (Phi_n + X Phi' X^T) B + compliance,   K = B^T X Phi',
//     b = B^T (X alpha' + c_n - alpha_n) + tau / armature,     S f = b + K r_p
// and leaves, with S = L D L^T and Z = L^-1 K,
//     Phi_p = Phi' - Z^T D^-1 Z,    alpha_p = alpha' - Z^T D^-1 L^-1 b.
// For the first joint on a body Phi' is its inverse inertia, so that for a joint of one axis X Phi'
// and X Phi' X^T are constants of the model in the frame before its motion. There B is a selection
// so that nothing but Phi_n has to be moved. A system once eliminated is
// solved again for other right-hand sides at a fraction of the cost.
#include <limits>
#include <vector>

#include "linkwise/dynamics/refinement.hpp"
#include "linkwise/kinematics/user_frames.hpp"
#include "linkwise/recursion/constraint_stack_steps.hpp"

namespace linkwise {

template <class S>
class ConstraintElimination {
 public:
  /// InputError naming the body when one has a singular inertia.
  explicit ConstraintElimination(const Model& model)
      : model_(&model),
        body_(model.n_bodies()),
        first_(first_of_siblings(model)),
        across_(model.n_bodies()),
        stack_(model.n_general),
        refinement_(model) {
    require_regular_inertias(model);
    for (int n = 0; n < model.n_bodies(); ++n)
      compliance_.push_back(compliance(model.constants[n].rigid));
    for_bodies_base_to_tip(model.kind_ranges, [&](auto joint, int n) {
      using J = decltype(joint);
      if constexpr (!is_general<J>)
        if (first_[n])
          calc_across<J>(model.constants[n], compliance_[model.topology[n].parent], across_[n]);
    });
  }

  /// du [nv]; loads [n_joints][6] and forces, the unknowns in the order of TreeSystem's, or null.
  /// Returns false when some S is not positive definite: `failed_body`.
  bool evaluate(const SweepInput<S>& in, S* du, S* loads, S* forces = nullptr) {
    failed_body_ = -1;
    sweep<false>(in, du);
    if (failed_body_ >= 0) return false;
    finish(in, du, loads, forces);
    return true;
  }

  /// The same at the q of the last evaluate(), which succeeded, with its factors.
  void evaluate_again(const SweepInput<S>& in, S* du, S* loads) {
    sweep<true>(in, du);
    finish(in, du, loads, nullptr);
  }

  int failed_body() const { return failed_body_; }

  int n_unknowns() const {
    int rows = 0;
    for (int n = 0; n < model_->n_bodies(); ++n) rows += constraint_rows(*model_, n);
    return rows;
  }

 private:
  struct BodyWork {
    Motion<S> v, a;     ///< velocity, acceleration
    Force<S> g;         ///< wrenches other than the joints' unknown ones
    Motion<S> alpha;    ///< answer to no wrench
    Compliance<S> Phi;  ///< answer to a wrench of the inboard joint, outboard joints eliminated
    Force<S> r;         ///< unknown wrench of the inboard joint, less those of outboard ones so far
    Force<S> load;      ///< wrench of the inboard joint
    ConstrainedAxis<S> axis;
    JointElimination<S> joint;  ///< the inboard one
  };

  const double* armature() const { return model_->dof_values(DofProperty::armature).data(); }
  /// Own answer of a body without outboard joints.
  Compliance<S> own(int n) const { return widen<S>(compliance_[n]); }

  /// `again`: of a system already eliminated.
  template <bool again>
  void sweep(const SweepInput<S>& in, S* du) {
    calc_velocities<again>(in);
    tip_to_base<again>(in);
    base_to_tip(in, du);
  }

  void finish(const SweepInput<S>& in, S* du, S* loads, S* forces) {
    if (loads) store_loads(in.q, loads);
    if (forces) for_forces([&, i = 0](const S& f) mutable { forces[i++] = f; });
    refine(in, du, loads, forces);
  }

  void store_loads(const S* q, S* loads) const {
    store_joint_loads(
        *model_, q, [&](int n) -> const Force<S>& { return body_[n].load; }, loads);
  }

  template <bool again>
  void calc_velocities(const SweepInput<S>& in) {
    const Model& model = *model_;
    const auto velocity_of = [&](int n) -> const Motion<S>& { return body_[n].v; };
    const auto step = [&](auto joint, int n, const Motion<S>& v_parent) {
      using J = decltype(joint);
      const BodyTopology& body = model.topology[n];
      const BodyConstants<double>& k = model.constants[n];
      BodyWork& w = body_[n];
      Force<S>* const g_parent = body.parent >= 0 ? &body_[body.parent].g : nullptr;
      if constexpr (is_general<J>) {
        stack_[body.general].calc_state(model, body, in, v_parent, again, w.v);
      } else {
        if constexpr (!again) calc_axis_pose<J>(k, in.q[body.q], w.axis.at);
        store(w.v, outward_velocity<J>(MovedAxis<J, S>{k, w.axis.at}, v_parent, k.pitch,
                                       in.v ? in.v[body.v] : S{}));
      }
      const Force<S> h = momentum_bias(k.rigid, w.v);
      w.g = {-h.lin, -h.ang};
      if constexpr (is_general<J>)
        stack_[body.general].add_drives(armature(), in.tau, w.g, g_parent);
      else
        with_rows<J>(k, [&](auto rows) {
          if constexpr (rows == 5) add_drive<J>(k.tree, in.tau[body.v], w.g, g_parent);
        });
    };
    sweep_outward(model, model.kind_ranges, Motion<S>{}, velocity_of, step);
    for_external_wrenches(model, in, [&](int n, const Force<S>& w) { body_[n].g += w; });
  }

  template <bool again>
  void tip_to_base(const SweepInput<S>& in) {
    const Model& model = *model_;
    const Motion<S> ground = ground_acceleration<S>(model, in.gravity_factor);
    for_bodies_tip_to_base(model.kind_ranges, [&](auto joint, int n) {
      using J = decltype(joint);
      const BodyTopology& body = model.topology[n];
      BodyWork& w = body_[n];
      if (body.n_children == 0) w.alpha = compliance_[n] * w.g;
      if (first_[n]) body_[body.parent].alpha = compliance_[body.parent] * body_[body.parent].g;
      const Motion<S>& a_parent = body.parent >= 0 ? body_[body.parent].alpha : ground;
      const auto reduce = [&](auto rows, const S* b) {
        const Motion<S> taken = w.joint.template reduce<rows>(b);
        if (body.parent >= 0) body_[body.parent].alpha += Motion<S>{-taken.lin, -taken.ang};
      };
      S b[6];
      if constexpr (is_general<J>) {
        stack_[body.general].calc_gap(armature(), in.tau, a_parent, w.alpha, b);
        if constexpr (!again) eliminate_stack(n, body);
        reduce(std::integral_constant<int, 6>{}, b);
      } else {
        const BodyConstants<double>& k = model.constants[n];
        with_rows<J>(k, [&](auto rows) {
          calc_gap<J, rows>(k, w.axis.at, a_parent, w.alpha, w.v, in.v ? in.v[body.v] : S{},
                            in.tau[body.v], b);
          if constexpr (!again) eliminate_axis<J, rows>(n, body);
          reduce(rows, b);
        });
      }
    });
  }

  template <class J, int rows>
  LW_INLINE void eliminate_axis(int n, const BodyTopology& body) {
    BodyWork& w = body_[n];
    const BodyConstants<double>& k = model_->constants[n];
    S D[21];
    assemble<J, rows>(k, body.n_children > 0 ? w.Phi : own(n), w.axis, D);
    if (body.parent < 0) {
      check(w.joint.template eliminate_root<rows>(D), n);
    } else if (BodyWork& parent = body_[body.parent]; first_[n]) {
      check(w.joint.template eliminate<rows>(D, across_[n], compliance_[body.parent], parent.Phi),
            n);
    } else {
      Across<S> across;
      calc_across<J>(k, parent.Phi, across);
      check(w.joint.template eliminate<rows>(D, across, parent.Phi, parent.Phi), n);
    }
  }

  void eliminate_stack(int n, const BodyTopology& body) {
    BodyWork& w = body_[n];
    S D[21];
    Across<S> across;
    Compliance<S> before{};
    if (body.parent >= 0) before = first_[n] ? own(body.parent) : body_[body.parent].Phi;
    stack_[body.general].assemble(body.n_children > 0 ? w.Phi : own(n), before, D, across);
    if (body.parent >= 0)
      check(w.joint.template eliminate<6>(D, across, before, body_[body.parent].Phi), n);
    else
      check(w.joint.template eliminate_root<6>(D), n);
  }

  void base_to_tip(const SweepInput<S>& in, S* du) {
    const Model& model = *model_;
    const Motion<S> ground = ground_acceleration<S>(model, in.gravity_factor);
    const auto acceleration_of = [&](int n) -> const Motion<S>& { return body_[n].a; };
    const auto step = [&](auto joint, int n, const Motion<S>& a_parent) {
      using J = decltype(joint);
      const BodyTopology& body = model.topology[n];
      if constexpr (is_general<J>)
        accelerate_stack(in, n, body, a_parent, du);
      else
        with_rows<J>(model.constants[n],
                     [&](auto rows) { accelerate_axis<J, rows>(in, n, body, a_parent, du); });
    };
    sweep_outward(model, model.kind_ranges, ground, acceleration_of, step);
  }

  template <class J, int rows>
  LW_INLINE void accelerate_axis(const SweepInput<S>& in, int n, const BodyTopology& body,
                                 const Motion<S>& a_parent, S* du) {
    const BodyConstants<double>& k = model_->constants[n];
    BodyWork& w = body_[n];
    w.joint.template solve_back<rows>(body.parent >= 0 ? body_[body.parent].r : Force<S>{});
    Force<S> r = to_wrench<J, rows>(k, w.joint.f);
    if (body.parent >= 0) body_[body.parent].r -= at_parent<J>(k, r);
    apply_motion<J>(w.axis.at, r);
    Motion<S> a;
    du[body.v] = accelerate<J>(k, w.axis, w.alpha, w.v, in.v ? in.v[body.v] : S{}, r, a_parent, a);
    store(w.a, a);
    store(w.r, r);
    if constexpr (rows == 5) (J::turns ? r.ang.z : r.lin.z) += in.tau[body.v];
    store(w.load, r);
  }

  void accelerate_stack(const SweepInput<S>& in, int n, const BodyTopology& body,
                        const Motion<S>& a_parent, S* du) {
    BodyWork& w = body_[n];
    const StackConstraint<S>& stack = stack_[body.general];
    w.joint.template solve_back<6>(body.parent >= 0 ? body_[body.parent].r : Force<S>{});
    const Force<S> r = stack.wrench(w.joint.f);
    if (body.parent >= 0) body_[body.parent].r -= stack.at_parent(r);
    w.a = stack.accelerate(a_parent, w.alpha, r, du);
    copy_prescribed(*model_, body, in, du);
    w.r = w.load = r;
    w.load += stack.known();
  }

  /// What rounding has cost: how far accelerations are from what the bodies' wrenches give.
  S violation() const {
    S worst{}, largest{};
    for (int n = 0; n < model_->n_bodies(); ++n) {
      Force<S> net = body_[n].g;
      net += body_[n].r;
      const Vector6<S> given = to_array(compliance_[n] * net), found = to_array(body_[n].a);
#pragma GCC unroll 6
      for (int i = 0; i < 6; ++i) {
        worst = larger(worst, absolute(S(given[i] - found[i])));
        largest = larger(largest, absolute(given[i]));
      }
    }
    return worst / (largest + std::numeric_limits<double>::min());
  }

  void refine(const SweepInput<S>& in, S* du, S* loads, S* forces) {
    const S off = violation();
    if (!Refinement<S>::is_due(off)) return;
    refinement_.refine(in, off, du, loads, [&](const auto& rest, S* more, S* more_loads) {
      sweep<true>(rest, more);
      if (more_loads) store_loads(in.q, more_loads);
      if (forces)
        for_forces([&, i = 0](const S& df) mutable {
          forces[i++] += Refinement<S>::choose(off, df, S{});
        });
    });
  }

  /// out(f) for all unknowns.
  template <class Out>
  void for_forces(Out&& out) const {
    for_bodies_base_to_tip(model_->kind_ranges, [&](auto joint, int n) {
      using J = decltype(joint);
      const BodyWork& w = body_[n];
      if constexpr (is_general<J>)
        for (int i = 0; i < stack_[model_->topology[n].general].rows(); ++i) out(w.joint.f[i]);
      else
        for_unknowns<J>(model_->constants[n], w.load, out);
    });
  }

  LW_INLINE void check(const S& d, int n) {
    for (int l = 0; l < lane_count<S>; ++l)
      if (__builtin_expect(!(lane(d, l) > 0), 0) && failed_body_ < 0) failed_body_ = n;
  }

  const Model* model_;
  std::vector<BodyWork> body_;
  std::vector<Compliance<double>> compliance_;  ///< the bodies' own
  std::vector<char> first_;                     ///< body: the first to give to its parent
  std::vector<Across<double>> across_;          ///< of those with a joint of one axis
  std::vector<StackConstraint<S>> stack_;
  Refinement<S> refinement_;
  int failed_body_ = -1;
};

}  // namespace linkwise
