#pragma once
// The three sweeps of the articulated-body recursion over chosen ranges of a tree, and what they
// keep of every body. A schedule owns one. It decides which ranges are swept when and by which
// thread. It hands in what it computes elsewhere: the motion of the bodies that carry a range, and
// what is contributed to them.
#include <algorithm>
#include <atomic>
#include <span>
#include <vector>

#include "linkwise/kinematics/body_state.hpp"
#include "linkwise/kinematics/placement.hpp"
#include "linkwise/kinematics/user_frames.hpp"
#include "linkwise/recursion/loop_steps.hpp"
#include "linkwise/recursion/own_bodies.hpp"
#include "linkwise/recursion/stack_steps.hpp"
#include "linkwise/recursion/steps.hpp"

namespace linkwise {

template <class S>
class TreeSweeps {
 public:
  using Ranges = std::vector<KindRange>;

  explicit TreeSweeps(const Model& tree)
      : model_(tree),
        body_(tree.n_bodies()),
        general_(tree.n_general),
        stack_(tree.n_general),
        own_(tree),
        receiver_(tree.n_bodies()) {
    const auto& armature = model_.dof_values(DofProperty::armature);
    const std::vector<char> opens = first_of_siblings(model_);
    for (int n = 0; n < model_.n_bodies(); ++n) {
      const BodyTopology& at = model_.topology[n];
      if (at.parent >= 0) receiver_[n] = {&body_[at.parent].sum, opens[n] != 0};
      if (at.joint_kind != JointKind::general || !is_free(model_, at)) continue;
      const auto rotors = armature.begin() + at.v;
      stack_[at.general].is_free = std::count(rotors, rotors + 6, 0.0) == 6;
    }
    bool hinges_only = true;
    for (const KindRange& range : model_.kind_ranges)
      hinges_only &= range.joint_kind == JointKind::hinge || range.end == 1;
    pose_.resize(hinges_only ? 1 : model_.n_bodies());
  }
  // Receivers point into it.
  TreeSweeps(const TreeSweeps&) = delete;
  TreeSweeps& operator=(const TreeSweeps&) = delete;

  /// From now on body n adds to what the schedule has opened by clear().
  void add_to_opened(int n) { receiver_[n].opens = false; }
  /// From now on what body n contributes to its parent goes to `sum`, which receives no other.
  void send_to(int n, Contribution<S>* sum) { receiver_[n] = {sum, true}; }

  // What the schedule hands in and takes out.
  const Motion<S>& velocity(int n) const { return body_[n].velocity; }
  const Motion<S>& acceleration(int n) const { return body_[n].acceleration; }
  const Contribution<S>& sum(int n) const { return body_[n].sum; }
  /// Parent's frame -> body n's, after calc_velocities().
  Transform<S> pose(int n) const {
    if (model_.topology[n].joint_kind != JointKind::hinge) return pose_[n];
    const HingePlacement<double> k = placement(model_.constants[n]);
    const S c = body_[n].cosine, s = body_[n].sine;
    const double ca = k.cos_alpha, sa = k.sin_alpha;
    return {{{c, s * ca, s * sa, -s, c * ca, c * sa, S{}, S{} - sa, S{} + ca}},
            {S{} + k.a, S{} - k.d * sa, S{} + k.d * ca}};
  }
  void set_velocity(int n, const Motion<S>& v) { body_[n].velocity = v; }
  void set_acceleration(int n, const Motion<S>& a) { body_[n].acceleration = a; }
  void set_joint_load(int n, const Force<S>& w) { reduced_[n].joint_load = w; }
  void clear(int n) { body_[n].sum = {}; }
  void clear_inertias(const Ranges& ranges) {
    for (const KindRange& range : ranges)
      for (int n = range.begin; n < range.end; ++n) body_[n].sum.Y = {};
  }
  void receive(int n, const Contribution<S>& more) { body_[n].sum += more; }

  void start(bool with_loads) {
    failed_body_ = -1;
    if (with_loads && reduced_.empty()) reduced_.resize(model_.n_bodies());
  }

  /// Body whose D is not positive, or -1.
  int failed_body() const { return failed_body_; }
  /// Of several failed bodies the outermost is named, whichever thread finds one first.
  void fail(int n) {
    int known = failed_body_;
    while (known < n && !failed_body_.compare_exchange_weak(known, n)) {
    }
  }

  /// Base to tip: velocities and bias wrenches. `again`: at the position of the last call.
  template <bool again = false>
  void calc_velocities(const SweepInput<S>& in, const Ranges& ranges) {
    const auto velocity_of = [&](int n) -> const Motion<S>& { return body_[n].velocity; };
    const auto step = [&](auto joint, int n, const auto& own, const Motion<S>& v_parent) {
      using J = decltype(joint);
      const BodyTopology& at = model_.topology[n];
      const BodyConstants<double>& k = model_.constants[n];
      Body& b = body_[n];
      if constexpr (is_general<J>) {
        calc_stack_velocity(in, n, v_parent);
      } else {
        if constexpr (!again) calc_placement<J>(in.q[at.q], n);
        store(b.velocity,
              outward_velocity<J>(place<J>(n), v_parent, k.pitch, in.v ? in.v[at.v] : S{}));
      }
      if constexpr (has_coordinates<std::remove_cvref_t<decltype(own)>>)
        b.sum.p = again ? own_.update_bias(in, n, b.velocity) : own_.update(in, n, b.velocity);
      else
        b.sum.p = momentum_bias(own, b.velocity);
    };
    sweep_bodies_outward(model_, ranges, Motion<S>{}, velocity_of, step);
  }

  /// What calc_velocities<true>() gives for a machine at rest.
  void rest(const SweepInput<S>& in) {
    for (int n = 0; n < model_.n_bodies(); ++n) {
      body_[n].velocity = {};
      body_[n].sum.p = {};
      if (own_.has(n)) own_.rest(n);
      const BodyTopology& at = model_.topology[n];
      if (at.joint_kind != JointKind::general) continue;
      BodyState<S> state;
      if (in.prescribed && !stack_[at.general].is_free)
        calc_general_state(model_, at, in, body_[n].velocity, state, general_[at.general]);
      stack_[at.general].c = state.c;
    }
  }

  void add_external(const SweepInput<S>& in) {
    for_external_wrenches(model_, in, [&](int n, const Force<S>& w) { body_[n].sum.p -= w; });
  }

  void add_wrench(int n, const Force<S>& w) { body_[n].sum.p -= w; }

  // Whether loads are wanted is asked while sweeping: two instantiations would be contracted to
  // fused multiply-adds in two ways, and recording loads would change the motion's last bits.

  /// Tip to base: eliminates the joints. Everything outboard of the ranges has contributed.
  void eliminate_joints(const SweepInput<S>& in, const Ranges& ranges, bool with_loads) {
    for_bodies_tip_to_base(model_, ranges, [&](auto joint, int n, const auto& own) {
      using J = decltype(joint);
      const BodyTopology& at = model_.topology[n];
      const BodyConstants<double>& k = model_.constants[n];
      Body& b = body_[n];
      ArticulatedInertia<S> Y{};
      if (at.n_children > 0) Y = b.sum.Y;
      if constexpr (has_coordinates<std::remove_cvref_t<decltype(own)>>) {
        if (!own_.eliminate(in, n, Y, b.sum.p)) fail(n);
      } else {
        add_inertia(Y, own);
      }
      if constexpr (is_general<J>) {
        eliminate_stack(in, n, Y, with_loads);
      } else {
        EliminatedAxis<S> axis;
        if (!eliminate_axis<J>(Y, b.sum.p, k, in.tau[at.v], axis)) fail(n);
        store(b.axis.U, axis.U);
        b.axis.D_inverse = axis.D_inverse;
        b.axis.h = axis.h;
        if (!with_loads && at.parent < 0) return;
        Force<S> p = b.sum.p;
        ReducedInertia<J, S> Ya;
        reduce<J>(Y, axis, J::bias(b.velocity, k.pitch, in.v ? in.v[at.v] : S{}), Ya, p);
        if (with_loads) keep<J>(n, Ya, p);
        if (at.parent >= 0) contribute(n, place<J>(n), Ya, p);
      }
    });
  }

  /// Tip to base over all bodies for another right-hand side, with the factors at hand.
  template <bool moving>
  void respond_joints(const SweepInput<S>& in) {
    for_bodies_tip_to_base(model_.kind_ranges, [&](auto joint, int n) {
      using J = decltype(joint);
      const BodyTopology& at = model_.topology[n];
      const BodyConstants<double>& k = model_.constants[n];
      Body& b = body_[n];
      if (own_.has(n)) own_.respond(in, n, b.sum.p);
      Force<S> p = b.sum.p;
      if constexpr (is_general<J>) {
        respond_stack(in, n, p);
        if (on_port(model_, at)) own_.receive(n, p);
      } else {
        Motion<S> c;
        if constexpr (moving) c = J::bias(b.velocity, k.pitch, in.v[at.v]);
        respond<J, moving>(reduced_[n].template inertia<J>(), c, k.pitch, in.tau[at.v], b.axis, p);
      }
      store(reduced_[n].p, p);
      if (at.parent >= 0) body_[at.parent].sum.p += place<J>(n).to_parent(p);
    });
  }

  /// Base to tip: accelerations and joint loads. Everything inboard of the ranges has its own.
  void accelerate_bodies(const SweepInput<S>& in, const Ranges& ranges, S* du, bool with_loads) {
    const Motion<S> ground = ground_acceleration<S>(model_, in.gravity_factor);
    const auto acceleration_of = [&](int n) -> const Motion<S>& { return body_[n].acceleration; };
    const auto step = [&](auto joint, int n, const Motion<S>& a_parent) {
      using J = decltype(joint);
      const BodyTopology& at = model_.topology[n];
      const BodyConstants<double>& k = model_.constants[n];
      Body& b = body_[n];
      Motion<S> a = place<J>(n).to_child(a_parent);
      if constexpr (is_general<J>)
        if (on_port(model_, at)) own_.accelerate_port(n, du, a);
      if (with_loads)
        store(reduced_[n].joint_load,
              outward_load(reduced_[n].template inertia<J>(), reduced_[n].p, a));
      if constexpr (is_general<J>) {
        accelerate_stack(in, n, a, du);
      } else {
        const Motion<S> c = J::bias(b.velocity, k.pitch, in.v ? in.v[at.v] : S{});
        du[at.v] = accelerate<J>(b.axis, c, k.pitch, a);
      }
      if (own_.has(n)) own_.accelerate(n, a, du);
      store(b.acceleration, a);
    };
    sweep_outward(model_, ranges, ground, acceleration_of, step);
  }

  /// What column k of body n's joint, eliminated, yields to its own torque: an entry of D^-1.
  S yielding(int n, int k) const {
    const BodyTopology& at = model_.topology[n];
    if (at.joint_kind != JointKind::general) return body_[n].axis.D_inverse;
    S unit[6]{};
    unit[k] = broadcast<S>(1);
    cholesky_solve(general_[at.general].n, stack_[at.general].columns.L, unit);
    return unit[k];
  }

  /// Forces of loops on body n, whose joint is eliminated, carried across that joint. Returns how
  /// many columns the joint has.
  template <class T>
  int carry_loops(const SweepInput<S>& in, int n, std::span<LoopColumn<T>> columns) const {
    int count = 0;
    with_joint(n, [&](auto joint, const BodyTopology& at) {
      using J = decltype(joint);
      const Body& b = body_[n];
      const double pitch = model_.constants[n].pitch;
      for (LoopColumn<T>& column : columns) {
        if constexpr (is_general<J>) {
          const Stack& own = stack_[at.general];
          count = own.is_free ? carry(own.free, column)
                              : carry(general_[at.general], own.columns, own.c, column);
        } else {
          const Motion<S> c = J::bias(b.velocity, pitch, in.v ? in.v[at.v] : S{});
          count = carry<J>(b.axis, c, pitch, column);
        }
        column.at_parent = to_parent<J>(n, column.F);
      }
    });
    return count;
  }

  /// The same across the coordinates of body n's own, before its joint: z, y
  /// [columns][coordinates], beta [columns] of each column.
  void carry_loops_own(int n, std::span<LoopColumn<S>> columns, const S* z, S* y, S* beta) const {
    const int count = own_.count(n);
    for (size_t i = 0; i < columns.size(); ++i)
      beta[i] = own_.carry(n, z + i * count, y + i * count, columns[i].F);
  }
  /// What body n, on a port, transmits along its parent's coordinates: adds to z.
  void push_own(int n, const Force<S>& F, S* z) const { own_.push(n, F, z); }
  /// Forces f of columns, now known, along the coordinates of body n's own.
  void apply_loops_own(int n, const S* z, const S* f, size_t columns) {
    const int count = own_.count(n);
    for (size_t i = 0; i < columns; ++i) own_.apply(n, f[i], z + i * count);
  }

  /// How many columns body n's joint has.
  int n_columns(int n) const {
    const BodyTopology& at = model_.topology[n];
    if (at.joint_kind != JointKind::general) return 1;
    return stack_[at.general].is_free ? 6 : general_[at.general].n;
  }

  /// The same forces, now known: of each column of the joint the sums of f z and f y.
  void apply_loops(int n, const S* z, const S* y) {
    with_joint(n, [&](auto joint, const BodyTopology& at) {
      if constexpr (!is_general<decltype(joint)>)
        apply(z, y, 1, body_[n].axis);
      else if (stack_[at.general].is_free)
        apply(z, y, 6, stack_[at.general].free);
      else
        apply(z, y, general_[at.general].n, stack_[at.general].columns);
    });
  }
  /// And each column on its own, for loads.
  void apply_loops(int n, std::span<const LoopColumn<S>> columns, const S* f, bool with_loads) {
    with_joint(n, [&](auto joint, const BodyTopology& at) {
      for (size_t i = 0; i < columns.size(); ++i) {
        if constexpr (is_general<decltype(joint)>) {
          Stack& own = stack_[at.general];
          if (own.is_free)
            apply(columns[i], f[i], own.free);
          else
            apply(columns[i], f[i], general_[at.general].n, own.columns);
        } else {
          apply(columns[i], f[i], body_[n].axis);
        }
        const Force<S>& F = columns[i].F;
        if (with_loads) reduced_[n].p -= f[i] * F;
      }
    });
  }

  void store_loads(const S* q, S* loads) const {
    store_joint_loads(
        model_, q, [&](int n) -> const Force<S>& { return reduced_[n].joint_load; }, loads);
  }

 private:
  // The unions over time keep a large tree in less memory: a fifth of the time of 10,000 bodies
  // (benchmarks/cpp/crossovers.cpp).
  struct Body {
    union {  // its velocity is last read when its acceleration is found
      Motion<S> velocity;
      Motion<S> acceleration;
    };
    Contribution<S> sum;  ///< its own bias wrench, and what outboard bodies contribute
    EliminatedAxis<S> axis;
    S cosine, sine;  ///< of a hinge
    Body() : velocity{} {}
  };
  /// Ya and pa of a body in its own frame: what it contributes, and what its joint load needs.
  struct Reduced {
    union {  // by the kind of its joint
      ArticulatedInertia<S> full;
      PlanarInertia<S> planar;
    };
    union {  // pa is last read when the load is found
      Force<S> p;
      Force<S> joint_load;
    };
    Reduced() : full{}, p{} {}
    template <class J>
    LW_INLINE auto& inertia() {
      if constexpr (J::leaves_zero_row)
        return planar;
      else
        return full;
    }
  };
  struct Stack {
    bool is_free = false;  ///< a floating joint without rotors
    Motion<S> c;
    union {  // by is_free
      EliminatedStack<S> columns;
      EliminatedFree<S> free;
    };
    Stack() : columns{} {}
  };
  /// Where the contribution of a body goes.
  struct Receiver {
    Contribution<S>* sum = nullptr;
    bool opens = false;  ///< sets sum->Y instead of adding to it
  };

  /// f(joint, body n's place in the tree).
  template <class F>
  void with_joint(int n, F&& f) const {
    const BodyTopology& at = model_.topology[n];
    dispatch_kind_range({at.joint_kind, at.body_kind, n, n + 1},
                        [&](auto joint, int, int) { f(joint, at); });
  }

  template <class J>
  LW_INLINE auto place(int n) const {
    if constexpr (J::is_hinge)
      return TurnedHinge<double, S>{placement(model_.constants[n]), body_[n].cosine, body_[n].sine};
    else
      return Pose<S>{pose_[n]};
  }

  /// X^T F of body n, of forces in lanes as well.
  template <class J, class T>
  LW_INLINE Force<T> to_parent(int n, const Force<T>& F) const {
    if constexpr (std::is_same_v<S, T>)
      return place<J>(n).to_parent(F);
    else if constexpr (J::is_hinge)
      return TurnedHinge<double, T>{placement(model_.constants[n]), T{} + body_[n].cosine,
                                    T{} + body_[n].sine}
          .to_parent(F);
    else
      return transpose_times(pose_[n], F);
  }

  template <class J>
  LW_INLINE void calc_placement(const S& q, int n) {
    const BodyConstants<double>& k = model_.constants[n];
    if constexpr (J::is_hinge)
      sincos(S(q + k.theta), body_[n].sine, body_[n].cosine);
    else
      pose_[n] = J::pose(k.tree, k.pitch, q);
  }

  template <class J>
  LW_INLINE static bool eliminate_axis(const ArticulatedInertia<S>& Y, const Force<S>& p,
                                       const BodyConstants<double>& k, const S& tau,
                                       EliminatedAxis<S>& axis) {
    if constexpr (J::leaves_zero_row)
      return is_positive(eliminate<J>(Y, p, k.pitch, NoRotor{}, tau, axis));
    else
      return is_positive(eliminate<J>(Y, p, k.pitch, k.armature, tau, axis));
  }

  template <class J>
  LW_INLINE void keep(int n, const ReducedInertia<J, S>& Ya, const Force<S>& p) {
    store(reduced_[n].template inertia<J>(), Ya);
    store(reduced_[n].p, p);
  }

  template <class Place, class Inertia>
  LW_INLINE void contribute(int n, const Place& at, const Inertia& Ya, const Force<S>& pa) {
    const Receiver& to = receiver_[n];
    const ArticulatedInertia<S> Y = at.to_parent(Ya);
    const Force<S> p = at.to_parent(pa);
    if (to.opens)
      store(to.sum->Y, Y);
    else
      to.sum->Y += Y;
    to.sum->p += p;
  }

  void calc_stack_velocity(const SweepInput<S>& in, int n, const Motion<S>& v_parent) {
    const BodyTopology& at = model_.topology[n];
    Stack& own = stack_[at.general];
    BodyState<S> state;
    if (own.is_free) {
      state.X = element_pose(model_.elements[at.first_element], in.q);
      Motion<S> relative{};
      if (in.v) relative = to_motion(in.v + at.v);
      state.v = state.X * v_parent;
      state.v += relative;
      state.c = cross(state.v, relative);
    } else if (on_port(model_, at)) {
      own_.update_port(in, n, v_parent, state);
      general_[at.general].n = 0;
    } else {
      calc_general_state(model_, at, in, v_parent, state, general_[at.general]);
    }
    pose_[n] = state.X;
    body_[n].velocity = state.v;
    own.c = state.c;
  }

  void eliminate_stack(const SweepInput<S>& in, int n, ArticulatedInertia<S>& Y, bool with_loads) {
    const BodyTopology& at = model_.topology[n];
    Stack& own = stack_[at.general];
    if (own.is_free) return eliminate_free(in, n, Y, with_loads);
    const GeneralState<S>& joint = general_[at.general];
    Force<S> p = body_[n].sum.p;
    const double* armature = model_.dof_values(DofProperty::armature).data();
    if (!eliminate(joint, Y, p, armature, in.tau, own.columns)) fail(n);
    if (!with_loads && at.parent < 0) return;
    reduce(joint.n, own.columns, own.c, Y, p);
    if (with_loads) keep<GeneralJoint>(n, Y, p);
    if (at.parent >= 0) contribute(n, place<GeneralJoint>(n), Y, p);
    if (on_port(model_, at)) own_.receive(n, pose_[n], Y, p);
  }

  /// The parent feels nothing but the joint's own forces.
  void eliminate_free(const SweepInput<S>& in, int n, const ArticulatedInertia<S>& Y,
                      bool with_loads) {
    const BodyTopology& at = model_.topology[n];
    const Force<S> tau = to_force(in.tau + at.v);
    if (!eliminate(Y, body_[n].sum.p, tau, stack_[at.general].free)) fail(n);
    const ArticulatedInertia<S> none{};
    if (with_loads) keep<GeneralJoint>(n, none, tau);
    if (at.parent >= 0) contribute(n, place<GeneralJoint>(n), none, tau);
  }

  void respond_stack(const SweepInput<S>& in, int n, Force<S>& p) {
    const BodyTopology& at = model_.topology[n];
    Stack& own = stack_[at.general];
    if (own.is_free) {
      const Force<S> tau = to_force(in.tau + at.v);
      respond(p, tau, own.free);
      p = tau;
    } else {
      respond(general_[at.general], reduced_[n].full, own.c, in.tau, own.columns, p);
    }
  }

  void accelerate_stack(const SweepInput<S>& in, int n, Motion<S>& a, S* du) {
    const BodyTopology& at = model_.topology[n];
    const Stack& own = stack_[at.general];
    if (own.is_free) {
      accelerate(own.free, own.c, a, du + at.v);
    } else {
      accelerate(general_[at.general], own.columns, own.c, a, du);
      copy_prescribed(model_, at, in, du);
    }
  }

  const Model& model_;
  std::vector<Body> body_;
  std::vector<Transform<S>> pose_;  ///< of bodies that are no hinges
  std::vector<GeneralState<S>> general_;
  std::vector<Stack> stack_;
  OwnBodies<S> own_;
  std::vector<Receiver> receiver_;
  std::vector<Reduced> reduced_;  ///< made when loads are first asked for
  std::atomic<int> failed_body_ = -1;
};

}  // namespace linkwise
