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
// For the first joint on a body Phi' is its inverse inertia, so that for a joint that turns about z
// X Phi' and X Phi' X^T are constants of the model in the frame before the turn. There B is a
// selection and f keeps its components, so that nothing but Phi_n has to be turned.
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "linkwise/constraint/joint_constraint.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/dynamics/joint_elimination.hpp"

namespace linkwise {

template <class S>
class ConstraintElimination {
 public:
  /// InputError naming the body when one has a singular inertia.
  explicit ConstraintElimination(const Model& model)
      : model_(&model),
        body_(model.n_bodies()),
        general_(model.n_general),
        slow_of_(model.n_bodies(), -1) {
    require_regular_inertias(model);
    int slow = 0;
    for (int n = 0; n < model.n_bodies(); ++n) {
      compliance_.push_back(invert_inertia(model.constants[n].inertia));
      if (!turns(model.topology[n].kind)) slow_of_[n] = slow++;
    }
    slow_.resize(slow);
    across_.resize(model.n_bodies());
    for (int n = 0; n < model.n_bodies(); ++n) {
      const BodyTopology& body = model.topology[n];
      if (turns(body.kind))
        set_across(n);
      else if (body.kind != BodyKind::general)
        set_axis(n);
    }
  }

  /// du [nv]; loads [n_joints][6] and forces, the unknowns in the order of TreeSystem's, or null.
  /// Returns false when some S is not positive definite: `failed_body`.
  bool evaluate(const SweepInput<S>& in, S* du, S* loads, S* forces = nullptr) {
    failed_body_ = -1;
    calc_velocities(in);
    tip_to_base<false>(in);
    base_to_tip<false>(in, du);
    if (failed_body_ >= 0) return false;
    if (loads)
      store_joint_loads(
          *model_, in.q, [&](int n) -> const Force<S>& { return body_[n].load; }, loads);
    if (forces) for_forces([&, i = 0](const S& f) mutable { forces[i++] = f; });
    correct(in, du, loads, forces);
    return true;
  }

  int failed_body() const { return failed_body_; }

  int n_unknowns() const {
    int rows = 0;
    for (int n = 0; n < model_->n_bodies(); ++n) rows += constraint_rows(*model_, n);
    return rows;
  }

 private:
  static constexpr double acceptable_violation = 1e-12;

  struct BodyWork {
    Motion<S> v;      ///< velocity, then acceleration
    Force<S> g;       ///< wrenches other than the joints' unknown ones
    Motion<S> alpha;  ///< answer to no wrench
    Force<S> r;       ///< unknown wrench of the inboard joint, less those of outboard joints so far
    Force<S> load;    ///< wrench of the inboard joint
    Motion<S> turn;   ///< Phi_n's column about z
    S cosine, sine;
    JointElimination<S> joint;  ///< the inboard one
  };
  /// A joint that does not turn about z.
  struct SlowJoint {
    Transform<S> X;
    Motion<S> c;
    Force<S> known;  ///< the drives' wrench
    Compliance<S> Phi;
    JointConstraint<S> joint;
    Motion<S> P[6];
  };

  static bool turns(BodyKind kind) {
    return kind == BodyKind::hinge || kind == BodyKind::revolute || kind == BodyKind::geared;
  }
  static HingePlacement<double> placement(const BodyConstants<double>& k) {
    return {k.cos_alpha, k.sin_alpha, k.a, k.d};
  }
  /// Parent frame -> frame of body n before its turn about z, and wrenches back.
  template <class J, class T>
  LW_INLINE Motion<T> before_turn(int n, const Motion<T>& v) const {
    if constexpr (J::is_hinge)
      return to_child(placement(model_->constants[n]), v);
    else
      return model_->constants[n].tree * v;
  }
  template <class J>
  LW_INLINE Force<S> at_parent(int n, const Force<S>& f) const {
    if constexpr (J::is_hinge)
      return to_parent(placement(model_->constants[n]), f);
    else
      return transpose_times(model_->constants[n].tree, f);
  }
  template <class J>
  LW_INLINE Motion<S> after_turn(int n, Motion<S> v) const {
    turn(body_[n].cosine, -body_[n].sine, v.lin.x, v.lin.y);
    turn(body_[n].cosine, -body_[n].sine, v.ang.x, v.ang.y);
    return v;
  }
  template <class J>
  static constexpr int rows_of = J::leaves_zero_row ? 5 : 6;
  template <class J>
  static constexpr bool turning = std::is_base_of_v<RevoluteJoint, J>;

  void set_across(int n) {
    const BodyTopology& body = model_->topology[n];
    if (body.parent < 0 || !body.first_to_give) return;
    if (body.kind == BodyKind::hinge)
      calc_across<HingeJoint>(n, compliance_[body.parent], across_[n]);
    else
      calc_across<RevoluteJoint>(n, compliance_[body.parent], across_[n]);
  }

  template <class J, class T>
  void calc_across(int n, const Compliance<T>& Phi, Across<T>& out) const {
    Vector6<T> columns[6];
    for (int j = 0; j < 6; ++j) columns[j] = to_array(before_turn<J>(n, column(Phi, j)));
    for (int i = 0; i < 6; ++i) {
      T row[6];
      for (int j = 0; j < 6; ++j) row[j] = columns[j][i];
      const Motion<T> K = to_motion(row);
      std::copy(row, row + 6, out.K[i]);
      const Vector6<T> W = to_array(before_turn<J>(n, K));
      for (int j = 0; j <= i; ++j) out.W[sym_index(i, j)] = W[j];
    }
  }

  /// The constraint of a slide or a screw is constant.
  void set_axis(int n) {
    const BodyTopology& body = model_->topology[n];
    SlowJoint& slow = slow_[slow_of_[n]];
    const Motion<double> axis = element_column<double>(model_->elements[body.first_element], 0);
    slow.P[0] = {axis.lin + Vec3<S>{}, axis.ang + Vec3<S>{}};
    calc_joint_constraint(slow.P, &body.v, 1, armature(), slow.joint);
  }
  const std::vector<double>& armature() const { return model_->dof_values(DofProperty::armature); }

  void calc_velocities(const SweepInput<S>& in) {
    const Model& model = *model_;
    const Motion<S> resting{};
    for_runs_base_to_tip(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& body = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        BodyWork& w = body_[n];
        const Motion<S>& v_parent = body.parent >= 0 ? body_[body.parent].v : resting;
        if constexpr (turning<J>) {
          sincos(S(in.q[body.q] + (J::is_hinge ? k.theta : 0.0)), w.sine, w.cosine);
          Motion<S> v = after_turn<J>(n, before_turn<J>(n, v_parent));
          J::add_rate(v, k.pitch, in.v ? in.v[body.v] : S{});
          w.v = v;
        } else {
          calc_slow_velocity<J>(in, n, v_parent);
        }
        const Force<S> h = cross_dual(w.v, k.inertia * w.v);
        w.g = {-h.lin, -h.ang};
        add_drive<J>(in, n, body);
      }
    });
    if (in.external)
      for (int j = 0; j < model.n_joints(); ++j)
        if (model.joints[j].last_of_body)
          body_[model.joints[j].body].g += user_wrench(in.external, model.joints[j], j);
  }

  template <class J>
  void calc_slow_velocity(const SweepInput<S>& in, int n, const Motion<S>& v_parent) {
    const BodyTopology& body = model_->topology[n];
    const BodyConstants<double>& k = model_->constants[n];
    SlowJoint& slow = slow_[slow_of_[n]];
    if constexpr (is_general<J>) {
      BodyState<S> state;
      GeneralState<S>& g = general_[body.general];
      calc_general_state(*model_, body, in, v_parent, state, g);
      slow.X = state.X;
      slow.c = state.c;
      body_[n].v = state.v;
      for (int i = 0; i < g.n; ++i) slow.P[i] = g.P[i];
      calc_joint_constraint(g.P, g.dof, g.n, armature(), slow.joint);
    } else {
      const S u = in.v ? in.v[body.v] : S{};
      slow.X = J::pose(k.tree, k.pitch, in.q[body.q]);
      Motion<S> v = slow.X * v_parent;
      J::add_rate(v, k.pitch, u);
      slow.c = J::bias(v, k.pitch, u);
      body_[n].v = v;
    }
  }

  /// The known wrench of joint n's drive, which is a plain torque where it turns.
  template <class J>
  LW_INLINE void add_drive(const SweepInput<S>& in, int n, const BodyTopology& body) {
    if constexpr (turning<J>) {
      if constexpr (rows_of<J> == 6) return;  // drives through the rotor
      const S tau = in.tau[body.v];
      body_[n].g.ang.z += tau;
      if (body.parent < 0) return;
      const auto& R = model_->constants[n].tree.R.m;
      Vec3<S>& moment = body_[body.parent].g.ang;
      moment.x -= R[6] * tau;
      moment.y -= R[7] * tau;
      moment.z -= R[8] * tau;
    } else {
      SlowJoint& slow = slow_[slow_of_[n]];
      slow.known = {};
      for (int i = 0; i < slow.joint.free; ++i) {
        const int dof = slow.joint.dof[i];
        if (armature()[dof] > 0) continue;
        const Force<S> one = to_force(slow.joint.dual[i].data());
        slow.known += Force<S>{in.tau[dof] * one.lin, in.tau[dof] * one.ang};
      }
      body_[n].g += slow.known;
      if (body.parent >= 0) body_[body.parent].g -= transpose_times(slow.X, slow.known);
    }
  }

  /// `response`: of a system already eliminated, at rest and without gravity.
  template <bool response>
  void tip_to_base(const SweepInput<S>& in) {
    const Model& model = *model_;
    const Motion<S> ground = ground_acceleration<S>(model, response ? 0.0 : in.gravity_factor);
    for_runs_tip_to_base(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = end - 1; n >= begin; --n) {
        const BodyTopology& body = model.topology[n];
        BodyWork& w = body_[n];
        if (body.n_children == 0) w.alpha = compliance_[n] * w.g;
        if (body.first_to_give)
          body_[body.parent].alpha = compliance_[body.parent] * body_[body.parent].g;
        const Motion<S>& a_parent = body.parent >= 0 ? body_[body.parent].alpha : ground;
        if constexpr (turning<J>)
          eliminate_turning<J, response>(in, n, body, a_parent);
        else
          eliminate_slow<response>(in, n, body, a_parent);
      }
    });
  }

  template <class J, bool response>
  LW_INLINE void eliminate_turning(const SweepInput<S>& in, int n, const BodyTopology& body,
                                   const Motion<S>& a_parent) {
    constexpr int rows = rows_of<J>;
    BodyWork& w = body_[n];
    Motion<S> gap = w.alpha;
    if constexpr (!response) gap += RevoluteJoint::bias(w.v, 0.0, in.v ? S(-in.v[body.v]) : S{});
    turn(w.cosine, w.sine, gap.lin.x, gap.lin.y);
    turn(w.cosine, w.sine, gap.ang.x, gap.ang.y);
    const Motion<S> carried = before_turn<J>(n, a_parent);
    S b[6] = {carried.lin.x - gap.lin.x, carried.lin.y - gap.lin.y, carried.lin.z - gap.lin.z,
              carried.ang.x - gap.ang.x, carried.ang.y - gap.ang.y, carried.ang.z - gap.ang.z};
    const double armature = rows == 6 ? model_->constants[n].armature : 0.0;
    if constexpr (rows == 6) b[5] = b[5] + in.tau[body.v] / armature;
    if constexpr (!response) {
      Compliance<S> Phi = body.n_children > 0 ? widen<S>(w.joint.Phi) : widen<S>(compliance_[n]);
      w.turn = column(Phi, 5);
      turn_back(w.cosine, w.sine, Phi);
      S D[21];
#pragma GCC unroll 6
      for (int i = 0; i < rows; ++i)
#pragma GCC unroll 6
        for (int j = 0; j <= i; ++j) D[sym_index(i, j)] = entry(Phi, i, j);
      if constexpr (rows == 6) D[20] = D[20] + 1 / armature;
      if (body.parent < 0) {
        check(w.joint.template eliminate_root<rows>(D), n);
      } else if (body.first_to_give) {
        check(w.joint.template eliminate<rows>(D, across_[n], compliance_[body.parent],
                                               body_[body.parent].joint.Phi),
              n);
      } else {
        Across<S> across;
        calc_across<J>(n, body_[body.parent].joint.Phi, across);
        check(w.joint.template eliminate<rows>(D, across, body_[body.parent].joint.Phi,
                                               body_[body.parent].joint.Phi),
              n);
      }
    }
    const Motion<S> taken = w.joint.template reduce<rows>(b);
    if (body.parent >= 0) body_[body.parent].alpha += Motion<S>{-taken.lin, -taken.ang};
  }

  template <bool response>
  void eliminate_slow(const SweepInput<S>& in, int n, const BodyTopology& body,
                      const Motion<S>& a_parent) {
    BodyWork& w = body_[n];
    SlowJoint& slow = slow_[slow_of_[n]];
    const JointConstraint<S>& joint = slow.joint;
    Motion<S> gap = slow.X * a_parent;
    if constexpr (!response) gap += slow.c;
    gap += Motion<S>{-w.alpha.lin, -w.alpha.ang};
    S b[6] = {};
    for (int i = 0; i < joint.rows; ++i) {
      b[i] = dot(gap, to_force(joint.B[i].data()));
      if (const int dof = joint.armature_of[i]; dof >= 0)
        b[i] = b[i] + in.tau[dof] / armature()[dof];
    }
    if constexpr (!response) {
      slow.Phi = body.n_children > 0 ? w.joint.Phi : widen<S>(compliance_[n]);
      Compliance<S> before{};
      if (body.parent >= 0)
        before =
            body.first_to_give ? widen<S>(compliance_[body.parent]) : body_[body.parent].joint.Phi;
      // Rows that are missing to six are empty but for a one on the diagonal.
      Across<S> across{};
      project(slow, before, across);
      S D[21] = {};
      for (int i = 0; i < 6; ++i) D[sym_index(i, i)] = broadcast<S>(1);
      for (int i = 0; i < joint.rows; ++i) {
        const Motion<S> y = slow.Phi * to_force(joint.B[i].data());
        for (int j = 0; j <= i; ++j) D[sym_index(i, j)] = dot(y, to_force(joint.B[j].data()));
        D[sym_index(i, i)] = D[sym_index(i, i)] + joint.compliance[i];
      }
      if (body.parent >= 0)
        check(w.joint.template eliminate<6>(D, across, before, body_[body.parent].joint.Phi), n);
      else
        check(w.joint.template eliminate_root<6>(D), n);
    }
    const Motion<S> taken = w.joint.template reduce<6>(b);
    if (body.parent >= 0) body_[body.parent].alpha += Motion<S>{-taken.lin, -taken.ang};
  }

  /// B^T X Phi' X^T B and B^T X Phi'.
  static void project(const SlowJoint& slow, const Compliance<S>& before, Across<S>& out) {
    for (int i = 0; i < slow.joint.rows; ++i) {
      const Force<S> lever = transpose_times(slow.X, to_force(slow.joint.B[i].data()));
      const Motion<S> K = before * lever;
      const Vector6<S> row = to_array(K);
      std::copy(row.begin(), row.end(), out.K[i]);
      const Motion<S> carried = slow.X * K;
      for (int j = 0; j <= i; ++j)
        out.W[sym_index(i, j)] = dot(carried, to_force(slow.joint.B[j].data()));
    }
  }

  template <bool response>
  void base_to_tip(const SweepInput<S>& in, S* du) {
    const Model& model = *model_;
    const Motion<S> ground = ground_acceleration<S>(model, response ? 0.0 : in.gravity_factor);
    const Force<S> nothing{};
    for_runs_base_to_tip(model, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& body = model.topology[n];
        BodyWork& w = body_[n];
        const Motion<S>& a_parent = body.parent >= 0 ? body_[body.parent].v : ground;
        if constexpr (turning<J>) {
          constexpr int rows = rows_of<J>;
          w.joint.template solve_back<rows>(body.parent >= 0 ? body_[body.parent].r : nothing);
          Force<S> r{{w.joint.f[0], w.joint.f[1], w.joint.f[2]},
                     {w.joint.f[3], w.joint.f[4], rows == 6 ? w.joint.f[5] : S{}}};
          if (body.parent >= 0) body_[body.parent].r -= at_parent<J>(n, r);
          turn(w.cosine, -w.sine, r.lin.x, r.lin.y);
          turn(w.cosine, -w.sine, r.ang.x, r.ang.y);
          Motion<S> a = after_turn<J>(n, before_turn<J>(n, a_parent));
          if constexpr (!response) a += J::bias(w.v, 0.0, in.v ? in.v[body.v] : S{});
          const S rate = dot(w.turn, r) + w.alpha.ang.z - a.ang.z;
          du[body.v] = rate;
          a.ang.z += rate;
          w.v = a;
          store(w.r, r);
          if constexpr (rows == 5) r.ang.z = in.tau[body.v];
          store(w.load, r);
        } else {
          accelerate_slow<response>(in, n, body, a_parent, du);
        }
      }
    });
  }

  template <bool response>
  void accelerate_slow(const SweepInput<S>& in, int n, const BodyTopology& body,
                       const Motion<S>& a_parent, S* du) {
    const Force<S> nothing{};
    BodyWork& w = body_[n];
    const SlowJoint& slow = slow_[slow_of_[n]];
    const JointConstraint<S>& joint = slow.joint;
    w.joint.template solve_back<6>(body.parent >= 0 ? body_[body.parent].r : nothing);
    Force<S> r{};
    for (int i = 0; i < joint.rows; ++i) {
      const Force<S> B = to_force(joint.B[i].data());
      r += Force<S>{w.joint.f[i] * B.lin, w.joint.f[i] * B.ang};
    }
    if (body.parent >= 0) body_[body.parent].r -= transpose_times(slow.X, r);
    Motion<S> a = slow.X * a_parent;
    if constexpr (!response) a += slow.c;
    Motion<S> gap = slow.Phi * r;
    gap += w.alpha;
    gap += Motion<S>{-a.lin, -a.ang};
    for (int i = 0; i < joint.free; ++i) {
      const S rate = dot(gap, to_force(joint.dual[i].data()));
      du[joint.dof[i]] = rate;
      a += Motion<S>{rate * slow.P[i].lin, rate * slow.P[i].ang};
    }
    if constexpr (!response) copy_prescribed(*model_, body, in, du);
    w.v = a;
    w.r = w.load = r;
    w.load += slow.known;
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

  /// Where a light body carries a heavy one, Phi holds the heavy one's answer in its last digits
  /// only. Newton-Euler, which does not suffer, gives the loads of the accelerations found and the
  /// torques that they miss; the answer to these, through the same factors, is added to both.
  void correct(const SweepInput<S>& in, S* du, S* loads, S* forces) {
    const S off = violation();
    bool any = false;
    for (int l = 0; l < lane_count<S>; ++l) any |= lane(off, l) > acceptable_violation;
    if (!any) return;
    const Model& model = *model_;
    if (!inverse_) inverse_ = std::make_unique<InverseDynamics<S>>(model);
    missing_.resize(model.nv());
    const int n_loads = loads ? 6 * model.n_joints() : 0;
    given_loads_.resize(n_loads);
    inverse_->evaluate(in, du, missing_.data(), loads ? given_loads_.data() : nullptr);
    for (int i = 0; i < model.nv(); ++i) missing_[i] = in.tau[i] - missing_[i];
    SweepInput<S> rest;
    rest.q = in.q;
    rest.tau = missing_.data();
    for (BodyWork& w : body_) w.g = {};
    for_runs_base_to_tip(model, [&](auto joint, int begin, int end) {
      for (int n = begin; n < end; ++n) add_drive<decltype(joint)>(rest, n, model.topology[n]);
    });
    response_.assign(model.nv(), S{});
    tip_to_base<true>(rest);
    base_to_tip<true>(rest, response_.data());
    const auto where = [&](const S& yes, const S& no) {
      return off > acceptable_violation ? yes : no;
    };
    for (int i = 0; i < model.nv(); ++i) du[i] = du[i] + where(response_[i], S{});
    if (forces) for_forces([&, i = 0](const S& df) mutable { forces[i] += where(df, S{}), ++i; });
    if (!loads) return;
    response_.resize(n_loads);
    store_joint_loads(
        model, in.q, [&](int n) -> const Force<S>& { return body_[n].load; }, response_.data());
    for (int i = 0; i < n_loads; ++i) loads[i] = where(given_loads_[i] + response_[i], loads[i]);
  }

  template <class Out>
  void for_forces(Out&& out) const {
    for (int n = 0; n < model_->n_bodies(); ++n) {
      const BodyWork& w = body_[n];
      if (slow_of_[n] >= 0) {
        for (int i = 0; i < slow_[slow_of_[n]].joint.rows; ++i) out(w.joint.f[i]);
        continue;
      }
      const Force<S>& r = w.load;
      if (model_->topology[n].kind == BodyKind::geared) out(r.ang.z);
      for (const S& x : {r.lin.x, r.lin.y, r.lin.z, r.ang.x, r.ang.y}) out(x);
    }
  }

  LW_INLINE void check(const S& d, int n) {
    for (int l = 0; l < lane_count<S>; ++l)
      if (__builtin_expect(!(lane(d, l) > 0), 0) && failed_body_ < 0) failed_body_ = n;
  }

  const Model* model_;
  std::vector<BodyWork> body_;
  std::vector<Compliance<double>> compliance_;  ///< the bodies' own
  std::vector<Across<double>> across_;
  std::vector<GeneralState<S>> general_;
  std::vector<int> slow_of_;  ///< body -> index into slow_, or -1 where the joint turns about z
  std::vector<SlowJoint> slow_;
  std::unique_ptr<InverseDynamics<S>> inverse_;  ///< made for the first correction
  std::vector<S> missing_, response_, given_loads_;
  int failed_body_ = -1;
};

}  // namespace linkwise
