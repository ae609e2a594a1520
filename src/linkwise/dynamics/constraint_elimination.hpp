#pragma once
// The constraint-force system A f = b of [sharf1993] assembled and eliminated in one sweep from tip
// to base: block Cholesky whose blocks never leave the registers, on scalars or lanes.
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
// (axis_constraint.hpp), so that nothing but Phi_n has to be moved. A system once eliminated is
// solved again for other right-hand sides at a fraction of the cost.
#include <limits>
#include <memory>
#include <type_traits>
#include <vector>

#include "linkwise/dynamics/axis_constraint.hpp"
#include "linkwise/dynamics/general_elimination.hpp"
#include "linkwise/dynamics/refinement.hpp"

namespace linkwise {

template <class S>
class ConstraintElimination {
 public:
  /// InputError naming the body when one has a singular inertia.
  explicit ConstraintElimination(const Model& model)
      : model_(&model),
        body_(model.n_bodies()),
        across_(model.n_bodies()),
        general_(model.n_general),
        refinement_(model) {
    require_regular_inertias(model);
    for (int n = 0; n < model.n_bodies(); ++n)
      compliance_.push_back(compliance(model.constants[n].inertia));
    for_kind_ranges_base_to_tip(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      if constexpr (!is_general<J>)
        for (int n = begin; n < end; ++n) {
          const BodyTopology& body = model.topology[n];
          if (body.parent >= 0 && body.first_to_give)
            calc_across<J>(model.constants[n], compliance_[body.parent], across_[n]);
        }
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
    Motion<S> v;      ///< velocity, then acceleration
    Force<S> g;       ///< wrenches other than the joints' unknown ones
    Motion<S> alpha;  ///< answer to no wrench
    Force<S> r;       ///< unknown wrench of the inboard joint, less those of outboard joints so far
    Force<S> load;    ///< wrench of the inboard joint
    Motion<S> along;  ///< Phi_n's column of the drive's direction
    AxisPose<S> at;
    JointElimination<S> joint;  ///< the inboard one
  };

  const std::vector<double>& armature() const { return model_->dof_values(DofProperty::armature); }

  /// f(rows), the number as a constant: five, or six where a joint drives through its rotor.
  template <class J, class F>
  LW_INLINE static void with_rows(const BodyConstants<double>& k, F&& f) {
    using Five = std::integral_constant<int, 5>;
    using Six = std::integral_constant<int, 6>;
    if constexpr (J::leaves_zero_row)
      f(Five{});
    else if constexpr (!J::slides)
      f(Six{});
    else if (k.armature > 0)
      f(Six{});
    else
      f(Five{});
  }

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
    const Motion<S> resting{};
    for_kind_ranges_base_to_tip(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& body = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        BodyWork& w = body_[n];
        const Motion<S>& v_parent = body.parent >= 0 ? body_[body.parent].v : resting;
        if constexpr (is_general<J>) {
          general_[body.general].calc_state(model, body, in, v_parent, again, w.v);
        } else {
          if constexpr (!again) calc_axis_pose<J>(k, in.q[body.q], w.at);
          store(w.v, outward_velocity<J>(MovedAxis<J, S>{k, w.at}, v_parent, k.pitch,
                                         in.v ? in.v[body.v] : S{}));
        }
        const Force<S> h = momentum_bias(k.inertia, w.v);
        w.g = {-h.lin, -h.ang};
        if constexpr (is_general<J>)
          general_[body.general].add_drives(armature(), in.tau, w.g,
                                            body.parent >= 0 ? &body_[body.parent].g : nullptr);
        else
          with_rows<J>(k, [&](auto rows) {
            if constexpr (rows == 5) add_drive<J>(in.tau[body.v], n, body);
          });
      }
    });
    if (in.external)
      for (int j = 0; j < model.n_joints(); ++j)
        if (model.joints[j].last_of_body)
          body_[model.joints[j].body].g += user_wrench(in.external, model.joints[j], j);
  }

  /// A drive without rotor: a plain torque or force on z, which the joint's motion leaves alone.
  template <class J>
  LW_INLINE void add_drive(const S& tau, int n, const BodyTopology& body) {
    const auto& tree = model_->constants[n].tree;
    const auto& R = tree.R.m;
    const Vec3<S> on_parent{R[6] * tau, R[7] * tau, R[8] * tau};
    Force<S>& g = body_[n].g;
    if constexpr (J::turns) {
      g.ang.z += tau;
      if (body.parent >= 0) body_[body.parent].g.ang -= on_parent;
    } else {
      g.lin.z += tau;
      if (body.parent >= 0) body_[body.parent].g -= Force<S>{on_parent, cross(tree.r, on_parent)};
    }
  }

  template <bool again>
  void tip_to_base(const SweepInput<S>& in) {
    const Model& model = *model_;
    const Motion<S> ground = ground_acceleration<S>(model, in.gravity_factor);
    for_kind_ranges_tip_to_base(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = end - 1; n >= begin; --n) {
        const BodyTopology& body = model.topology[n];
        BodyWork& w = body_[n];
        if (body.n_children == 0) w.alpha = compliance_[n] * w.g;
        if (body.first_to_give)
          body_[body.parent].alpha = compliance_[body.parent] * body_[body.parent].g;
        const Motion<S>& a_parent = body.parent >= 0 ? body_[body.parent].alpha : ground;
        if constexpr (is_general<J>)
          eliminate_general<again>(in, n, body, a_parent);
        else
          with_rows<J>(model.constants[n],
                       [&](auto rows) { eliminate_axis<J, rows, again>(in, n, body, a_parent); });
      }
    });
  }

  template <class J, int rows, bool again>
  LW_INLINE void eliminate_axis(const SweepInput<S>& in, int n, const BodyTopology& body,
                                const Motion<S>& a_parent) {
    BodyWork& w = body_[n];
    const BodyConstants<double>& k = model_->constants[n];
    Motion<S> gap = w.alpha;
    gap += J::bias(w.v, k.pitch, in.v ? S(-in.v[body.v]) : S{});
    undo_motion<J>(w.at, gap);
    const Motion<S> carried = before_motion<J>(k, a_parent);
    S b[6];
    to_components<J>(Motion<S>{carried.lin - gap.lin, carried.ang - gap.ang}, k.pitch, b);
    if constexpr (rows == 6) b[5] = b[5] + in.tau[body.v] / k.armature;
    if constexpr (!again) {
      Compliance<S> Phi = body.n_children > 0 ? widen<S>(w.joint.Phi) : widen<S>(compliance_[n]);
      w.along = column(Phi, J::turns ? 5 : 2);
      undo_motion<J>(w.at, Phi);
      S D[21];
      to_components<J, rows>(Phi, k.pitch, D);
      if constexpr (rows == 6) D[20] = D[20] + 1 / k.armature;
      if (body.parent < 0) {
        check(w.joint.template eliminate_root<rows>(D), n);
      } else if (body.first_to_give) {
        check(w.joint.template eliminate<rows>(D, across_[n], compliance_[body.parent],
                                               body_[body.parent].joint.Phi),
              n);
      } else {
        Across<S> across;
        calc_across<J>(k, body_[body.parent].joint.Phi, across);
        check(w.joint.template eliminate<rows>(D, across, body_[body.parent].joint.Phi,
                                               body_[body.parent].joint.Phi),
              n);
      }
    }
    const Motion<S> taken = w.joint.template reduce<rows>(b);
    if (body.parent >= 0) body_[body.parent].alpha += Motion<S>{-taken.lin, -taken.ang};
  }

  template <bool again>
  void eliminate_general(const SweepInput<S>& in, int n, const BodyTopology& body,
                         const Motion<S>& a_parent) {
    BodyWork& w = body_[n];
    GeneralElimination<S>& general = general_[body.general];
    S b[6];
    general.calc_gap(armature(), in.tau, a_parent, w.alpha, b);
    if constexpr (!again) {
      S D[21];
      Across<S> across;
      Compliance<S> before{};
      if (body.parent >= 0)
        before =
            body.first_to_give ? widen<S>(compliance_[body.parent]) : body_[body.parent].joint.Phi;
      general.assemble(body.n_children > 0 ? w.joint.Phi : widen<S>(compliance_[n]), before, D,
                       across);
      if (body.parent >= 0)
        check(w.joint.template eliminate<6>(D, across, before, body_[body.parent].joint.Phi), n);
      else
        check(w.joint.template eliminate_root<6>(D), n);
    }
    const Motion<S> taken = w.joint.template reduce<6>(b);
    if (body.parent >= 0) body_[body.parent].alpha += Motion<S>{-taken.lin, -taken.ang};
  }

  void base_to_tip(const SweepInput<S>& in, S* du) {
    const Model& model = *model_;
    const Motion<S> ground = ground_acceleration<S>(model, in.gravity_factor);
    for_kind_ranges_base_to_tip(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& body = model.topology[n];
        const Motion<S>& a_parent = body.parent >= 0 ? body_[body.parent].v : ground;
        if constexpr (is_general<J>)
          accelerate_general(in, n, body, a_parent, du);
        else
          with_rows<J>(model.constants[n],
                       [&](auto rows) { accelerate_axis<J, rows>(in, n, body, a_parent, du); });
      }
    });
  }

  template <class J, int rows>
  LW_INLINE void accelerate_axis(const SweepInput<S>& in, int n, const BodyTopology& body,
                                 const Motion<S>& a_parent, S* du) {
    const Force<S> nothing{};
    const BodyConstants<double>& k = model_->constants[n];
    BodyWork& w = body_[n];
    w.joint.template solve_back<rows>(body.parent >= 0 ? body_[body.parent].r : nothing);
    Force<S> r = to_wrench<J>(w.joint.f, rows == 6 ? w.joint.f[5] : S{}, k.pitch);
    if (body.parent >= 0) body_[body.parent].r -= at_parent<J>(k, r);
    apply_motion<J>(w.at, r);
    Motion<S> a = MovedAxis<J, S>{k, w.at}.to_child(a_parent);
    a += J::bias(w.v, k.pitch, in.v ? in.v[body.v] : S{});
    const S rate = dot(w.along, r) + rate_of<J>(w.alpha) - rate_of<J>(a);
    du[body.v] = rate;
    J::add_rate(a, k.pitch, rate);
    store(w.v, a);
    store(w.r, r);
    if constexpr (rows == 5) (J::turns ? r.ang.z : r.lin.z) += in.tau[body.v];
    store(w.load, r);
  }

  void accelerate_general(const SweepInput<S>& in, int n, const BodyTopology& body,
                          const Motion<S>& a_parent, S* du) {
    const Force<S> nothing{};
    BodyWork& w = body_[n];
    const GeneralElimination<S>& general = general_[body.general];
    w.joint.template solve_back<6>(body.parent >= 0 ? body_[body.parent].r : nothing);
    const Force<S> r = general.wrench(w.joint.f);
    if (body.parent >= 0) body_[body.parent].r -= general.at_parent(r);
    w.v = general.accelerate(a_parent, w.alpha, r, du);
    copy_prescribed(*model_, body, in, du);
    w.r = w.load = r;
    w.load += general.known();
  }

  /// Largest difference of the bodies' accelerations from what their wrenches give, over the
  /// largest acceleration: what rounding has cost.
  S violation() const {
    S worst{}, largest{};
    for (int n = 0; n < model_->n_bodies(); ++n) {
      const BodyWork& w = body_[n];
      Force<S> net = w.g;
      net += w.r;
      const Motion<S> a = compliance_[n] * net;
      const S given[6] = {a.lin.x, a.lin.y, a.lin.z, a.ang.x, a.ang.y, a.ang.z};
      const S found[6] = {w.v.lin.x, w.v.lin.y, w.v.lin.z, w.v.ang.x, w.v.ang.y, w.v.ang.z};
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

  /// In the bases that calc_joint_constraint() chooses.
  template <class Out>
  void for_forces(Out&& out) const {
    for_kind_ranges_base_to_tip(*model_, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyWork& w = body_[n];
        if constexpr (is_general<J>) {
          for (int i = 0; i < general_[model_->topology[n].general].rows(); ++i) out(w.joint.f[i]);
        } else {
          const BodyConstants<double>& k = model_->constants[n];
          const Force<S>& r = w.load;
          if (k.armature > 0) out(J::project(r, k.pitch));
          out(r.lin.x);
          out(r.lin.y);
          if constexpr (!J::slides)
            out(r.lin.z);
          else if constexpr (J::turns)
            out((r.lin.z - k.pitch * r.ang.z) / std::sqrt(1 + k.pitch * k.pitch));
          out(r.ang.x);
          out(r.ang.y);
          if constexpr (!J::turns) out(r.ang.z);
        }
      }
    });
  }

  LW_INLINE void check(const S& d, int n) {
    for (int l = 0; l < lane_count<S>; ++l)
      if (__builtin_expect(!(lane(d, l) > 0), 0) && failed_body_ < 0) failed_body_ = n;
  }

  const Model* model_;
  std::vector<BodyWork> body_;
  std::vector<Compliance<double>> compliance_;  ///< the bodies' own
  std::vector<Across<double>> across_;          ///< of each body's first joint of one axis
  std::vector<GeneralElimination<S>> general_;
  Refinement<S> refinement_;
  int failed_body_ = -1;
};

}  // namespace linkwise
