#pragma once
// The three sweeps of the articulated-body recursion over chosen ranges of a tree, and what they
// keep of every body. A schedule owns one. It decides which ranges are swept when and by which
// thread. It fills in what it computes elsewhere: the motion of the bodies that carry a range, and
// what is contributed to them.
#include <algorithm>
#include <atomic>
#include <vector>

#include "linkwise/kinematics/body_state.hpp"
#include "linkwise/kinematics/placement.hpp"
#include "linkwise/recursion/stack_steps.hpp"
#include "linkwise/recursion/steps.hpp"

namespace linkwise {

template <class S>
struct TreeSweeps {
  using Ranges = std::vector<KindRange>;

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

  explicit TreeSweeps(const Model& tree)
      : model(tree),
        body(tree.n_bodies()),
        general(tree.n_general),
        stack(tree.n_general),
        receiver(tree.n_bodies()) {
    const auto& armature = model.dof_values(DofProperty::armature);
    for (int n = 0; n < model.n_bodies(); ++n) {
      const BodyTopology& at = model.topology[n];
      if (at.parent >= 0) receiver[n] = {&body[at.parent].sum, at.first_to_give};
      if (at.joint_kind != JointKind::general || !is_free(model, at)) continue;
      const auto rotors = armature.begin() + at.v;
      stack[at.general].is_free = std::count(rotors, rotors + 6, 0.0) == 6;
    }
    bool hinges_only = true;
    for (const KindRange& range : model.kind_ranges)
      hinges_only &= range.joint_kind == JointKind::hinge || range.end == 1;
    pose.resize(hinges_only ? 1 : model.n_bodies());
  }
  // Receivers point into it.
  TreeSweeps(const TreeSweeps&) = delete;
  TreeSweeps& operator=(const TreeSweeps&) = delete;

  const Model& model;
  std::vector<Body> body;
  std::vector<Transform<S>> pose;  ///< of bodies that are no hinges
  std::vector<GeneralState<S>> general;
  std::vector<Stack> stack;
  std::vector<Receiver> receiver;
  std::vector<Reduced> reduced;  ///< made when loads are first asked for
  std::atomic<int> failed_body = -1;

  void start(bool with_loads) {
    failed_body = -1;
    if (with_loads && reduced.empty()) reduced.resize(model.n_bodies());
  }

  /// Of several failed bodies the outermost is named, whichever thread finds one first.
  void fail(int n) {
    int known = failed_body;
    while (known < n && !failed_body.compare_exchange_weak(known, n)) {
    }
  }

  /// Base to tip: velocities and bias wrenches. `again`: at the position of the last call.
  template <bool again = false>
  void calc_velocities(const SweepInput<S>& in, const Ranges& ranges) {
    const Motion<S> resting{};
    for_kind_ranges_base_to_tip(ranges, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& at = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        Body& b = body[n];
        const Motion<S>& v_parent = at.parent >= 0 ? body[at.parent].velocity : resting;
        if constexpr (is_general<J>) {
          calc_stack_velocity(in, n, v_parent);
        } else {
          if constexpr (!again) calc_placement<J>(in.q[at.q], n);
          store(b.velocity,
                outward_velocity<J>(place<J>(n), v_parent, k.pitch, in.v ? in.v[at.v] : S{}));
        }
        b.sum.p = momentum_bias(k.inertia, b.velocity);
      }
    });
  }

  /// What calc_velocities<true>() gives for a machine at rest.
  void rest(const SweepInput<S>& in) {
    for (int n = 0; n < model.n_bodies(); ++n) {
      body[n].velocity = {};
      body[n].sum.p = {};
      const BodyTopology& at = model.topology[n];
      if (at.joint_kind != JointKind::general) continue;
      BodyState<S> state;
      if (in.prescribed && !stack[at.general].is_free)
        calc_general_state(model, at, in, body[n].velocity, state, general[at.general]);
      stack[at.general].c = state.c;
    }
  }

  void add_external(const SweepInput<S>& in) {
    if (!in.external) return;
    for (int j = 0; j < model.n_joints(); ++j)
      if (model.joints[j].last_of_body)
        body[model.joints[j].body].sum.p -= user_wrench(in.external, model.joints[j], j);
  }

  // Whether loads are wanted is asked while sweeping: two instantiations would be contracted to
  // fused multiply-adds in two ways, and recording loads would change the motion's last bits.

  /// Tip to base: eliminates the joints. Everything outboard of the ranges has contributed.
  void eliminate_joints(const SweepInput<S>& in, const Ranges& ranges, bool with_loads) {
    for_kind_ranges_tip_to_base(ranges, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = end - 1; n >= begin; --n) {
        const BodyTopology& at = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        Body& b = body[n];
        ArticulatedInertia<S> Y{};
        if (at.n_children > 0) Y = b.sum.Y;
        add_inertia(Y, k.inertia);
        if constexpr (is_general<J>) {
          eliminate_stack(in, n, Y, with_loads);
        } else {
          EliminatedAxis<S> axis;
          if (!eliminate_axis<J>(Y, b.sum.p, k, in.tau[at.v], axis)) fail(n);
          store(b.axis.U, axis.U);
          b.axis.D_inverse = axis.D_inverse;
          b.axis.u = axis.u;
          if (!with_loads && at.parent < 0) continue;
          Force<S> p = b.sum.p;
          ReducedInertia<J, S> Ya;
          reduce<J>(Y, axis, J::bias(b.velocity, k.pitch, in.v ? in.v[at.v] : S{}), Ya, p);
          if (with_loads) keep<J>(n, Ya, p);
          if (at.parent >= 0) contribute(n, place<J>(n), Ya, p);
        }
      }
    });
  }

  /// Tip to base over all bodies for another right-hand side, with the factors at hand.
  template <bool moving>
  void respond_joints(const SweepInput<S>& in) {
    for_kind_ranges_tip_to_base(model.kind_ranges, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = end - 1; n >= begin; --n) {
        const BodyTopology& at = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        Body& b = body[n];
        Force<S> p = b.sum.p;
        if constexpr (is_general<J>) {
          respond_stack(in, n, p);
        } else {
          Motion<S> c;
          if constexpr (moving) c = J::bias(b.velocity, k.pitch, in.v[at.v]);
          respond<J, moving>(reduced[n].template inertia<J>(), c, k.pitch, in.tau[at.v], b.axis, p);
        }
        store(reduced[n].p, p);
        if (at.parent >= 0) body[at.parent].sum.p += place<J>(n).to_parent(p);
      }
    });
  }

  /// Base to tip: accelerations and joint loads. Everything inboard of the ranges has its own.
  void accelerate_bodies(const SweepInput<S>& in, const Ranges& ranges, S* du, bool with_loads) {
    const Motion<S> ground = ground_acceleration<S>(model, in.gravity_factor);
    for_kind_ranges_base_to_tip(ranges, [&](auto joint, int begin, int end) {
      using J = decltype(joint);
      for (int n = begin; n < end; ++n) {
        const BodyTopology& at = model.topology[n];
        const BodyConstants<double>& k = model.constants[n];
        Body& b = body[n];
        Motion<S> a = place<J>(n).to_child(at.parent >= 0 ? body[at.parent].acceleration : ground);
        if (with_loads)
          store(reduced[n].joint_load,
                outward_load(reduced[n].template inertia<J>(), reduced[n].p, a));
        if constexpr (is_general<J>) {
          accelerate_stack(in, n, a, du);
        } else {
          const Motion<S> c = J::bias(b.velocity, k.pitch, in.v ? in.v[at.v] : S{});
          du[at.v] = accelerate<J>(b.axis, c, k.pitch, a);
        }
        store(b.acceleration, a);
      }
    });
  }

  void store_loads(const S* q, S* loads) const {
    store_joint_loads(
        model, q, [&](int n) -> const Force<S>& { return reduced[n].joint_load; }, loads);
  }

 private:
  template <class J>
  LW_INLINE auto place(int n) const {
    if constexpr (J::is_hinge)
      return TurnedHinge<double, S>{placement(model.constants[n]), body[n].cosine, body[n].sine};
    else
      return Pose<S>{pose[n]};
  }

  template <class J>
  LW_INLINE void calc_placement(const S& q, int n) {
    const BodyConstants<double>& k = model.constants[n];
    if constexpr (J::is_hinge)
      sincos(S(q + k.theta), body[n].sine, body[n].cosine);
    else
      pose[n] = J::pose(k.tree, k.pitch, q);
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
    store(reduced[n].template inertia<J>(), Ya);
    store(reduced[n].p, p);
  }

  template <class Place, class Inertia>
  LW_INLINE void contribute(int n, const Place& at, const Inertia& Ya, const Force<S>& pa) {
    const Receiver& to = receiver[n];
    const ArticulatedInertia<S> Y = at.to_parent(Ya);
    const Force<S> p = at.to_parent(pa);
    if (to.opens)
      store(to.sum->Y, Y);
    else
      to.sum->Y += Y;
    to.sum->p += p;
  }

  void calc_stack_velocity(const SweepInput<S>& in, int n, const Motion<S>& v_parent) {
    const BodyTopology& at = model.topology[n];
    Stack& own = stack[at.general];
    BodyState<S> state;
    if (own.is_free) {
      state.X = element_pose(model.elements[at.first_element], in.q);
      Motion<S> relative{};
      if (in.v) relative = to_motion(in.v + at.v);
      state.v = state.X * v_parent;
      state.v += relative;
      state.c = cross(state.v, relative);
    } else {
      calc_general_state(model, at, in, v_parent, state, general[at.general]);
    }
    pose[n] = state.X;
    body[n].velocity = state.v;
    own.c = state.c;
  }

  void eliminate_stack(const SweepInput<S>& in, int n, ArticulatedInertia<S>& Y, bool with_loads) {
    const BodyTopology& at = model.topology[n];
    Stack& own = stack[at.general];
    if (own.is_free) return eliminate_free(in, n, Y, with_loads);
    const GeneralState<S>& joint = general[at.general];
    Force<S> p = body[n].sum.p;
    const double* armature = model.dof_values(DofProperty::armature).data();
    if (!eliminate(joint, Y, p, armature, in.tau, own.columns)) fail(n);
    if (!with_loads && at.parent < 0) return;
    reduce(joint.n, own.columns, own.c, Y, p);
    if (with_loads) keep<GeneralJoint>(n, Y, p);
    if (at.parent >= 0) contribute(n, place<GeneralJoint>(n), Y, p);
  }

  /// The parent feels nothing but the joint's own forces.
  void eliminate_free(const SweepInput<S>& in, int n, const ArticulatedInertia<S>& Y,
                      bool with_loads) {
    const BodyTopology& at = model.topology[n];
    const Force<S> tau = to_force(in.tau + at.v);
    if (!eliminate(Y, body[n].sum.p, tau, stack[at.general].free)) fail(n);
    const ArticulatedInertia<S> none{};
    if (with_loads) keep<GeneralJoint>(n, none, tau);
    if (at.parent >= 0) contribute(n, place<GeneralJoint>(n), none, tau);
  }

  void respond_stack(const SweepInput<S>& in, int n, Force<S>& p) {
    const BodyTopology& at = model.topology[n];
    Stack& own = stack[at.general];
    if (own.is_free) {
      const Force<S> tau = to_force(in.tau + at.v);
      respond(p, tau, own.free);
      p = tau;
    } else {
      respond(general[at.general], reduced[n].full, own.c, in.tau, own.columns, p);
    }
  }

  void accelerate_stack(const SweepInput<S>& in, int n, Motion<S>& a, S* du) {
    const BodyTopology& at = model.topology[n];
    const Stack& own = stack[at.general];
    if (own.is_free) {
      accelerate(own.free, own.c, a, du + at.v);
    } else {
      accelerate(general[at.general], own.columns, own.c, a, du);
      copy_prescribed(model, at, in, du);
    }
  }
};

}  // namespace linkwise
