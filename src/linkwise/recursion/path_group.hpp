#pragma once
// The articulated-body recursion along the paths of one group, one path per lane, by the steps of
// steps.hpp. The order of the groups is in dynamics/articulated_paths.hpp.
#include <algorithm>
#include <array>
#include <vector>

#include "linkwise/kinematics/body_state.hpp"
#include "linkwise/recursion/lane_bodies.hpp"
#include "linkwise/recursion/steps.hpp"

namespace linkwise {

/// Where a body of a path is.
struct PathPlace {
  int group = -1, position = 0, lane = 0;
};

template <class S>
class PathGroup {
 public:
  static constexpr int lanes = lane_count<S>;
  /// The innermost body of a path.
  struct Root {
    int position, lane;
    int parent;       ///< the body that carries it, or -1: ground
    PathPlace place;  ///< the parent's, where it is on a path
  };
  /// A path of this or of an earlier group hangs on a body here.
  struct Branch {
    int position, lane;
    PathPlace root;  ///< of that path
  };
  /// A body here carries bodies that are on no path.
  struct OuterParent {
    int position, lane, body;
  };

  /// body_at(k, l): body of position k in lane l, or -1.
  template <class BodyAt>
  PathGroup(const Model& model, int length, BodyAt&& body_at)
      : bodies_(model, length, body_at), index_(length), state_(length), root_at_(length, -1) {
    for (int k = 0; k < length; ++k)
      for (int l = 0; l < lanes; ++l) {
        const int n = body_at(k, l);
        index_[k].body[l] = n;
        index_[k].q[l] = n < 0 ? -1 : model.topology[n].q;
        index_[k].v[l] = n < 0 ? -1 : model.topology[n].v;
      }
  }

  int length() const { return bodies_.length(); }
  const std::vector<Branch>& branches() const { return branches_; }
  const std::vector<OuterParent>& outer_parents() const { return outer_parents_; }

  void add_branch(const Branch& branch) { branches_.push_back(branch); }
  void add_outer_parent(const OuterParent& parent) { outer_parents_.push_back(parent); }
  void add_root(const Root& root) {
    roots_.push_back(root);
    if (root_at_[root.position] >= 0) return;
    root_at_[root.position] = static_cast<int>(from_root_.size());
    from_root_.push_back({});
  }
  /// After the last one was added.
  void sort() {
    const auto outermost = [](const auto& a, const auto& b) { return a.position < b.position; };
    std::stable_sort(roots_.begin(), roots_.end(), outermost);
    std::stable_sort(branches_.begin(), branches_.end(), outermost);
    std::stable_sort(outer_parents_.begin(), outer_parents_.end(), outermost);
  }
  void keep_loads() { reduced_.resize(length()); }

  /// f(position, lane, body) of all its bodies.
  template <class F>
  void for_bodies(F&& f) const {
    for (int k = 0; k < length(); ++k)
      for (int l = 0; l < lanes; ++l)
        if (const int n = index_[k].body[l]; n >= 0) f(k, l, n);
  }

  Motion<double> velocity(int k, int l) const {
    return get_lanes<Motion<double>, S>(state_[k].velocity, l);
  }
  Motion<double> acceleration(int k, int l) const {
    return get_lanes<Motion<double>, S>(state_[k].acceleration, l);
  }
  Force<double> joint_load(int k, int l) const {
    return get_lanes<Force<double>, S>(reduced_[k].joint_load, l);
  }
  /// What the roots at position k contribute to the bodies that carry them.
  const Contribution<S>& from_roots_at(int k) const { return from_root_[root_at_[k]]; }
  void add_wrench(int k, int l, const Force<double>& p) { add_lanes<S>(state_[k].bias, l, p); }

  /// parent(root): the velocity of the body that carries the path.
  template <class ParentMotion>
  void calc_velocities(const SweepInput<double>& in, ParentMotion&& parent) {
    Motion<S> v{};
    size_t root = roots_.size();
    for (int k = length() - 1; k >= 0; --k) {
      State& s = state_[k];
      enter(k, root, parent, v);
      bodies_.turn_to(k, gather(in.q, index_[k].q), s.turn);
      s.rate = in.v ? gather(in.v, index_[k].v) : S{};
      s.tau = gather(in.tau, index_[k].v);
      v = outward_velocity<RevoluteJoint>(bodies_.place(k, s.turn), v, 0.0, s.rate);
      store(s.velocity, v);
      s.bias = momentum_bias(bodies_[k].body, v);
    }
  }

  /// group(place): that of a place. from_outer(parent): the inertia that it carries on no path.
  /// Returns the number of a body whose D is not positive, the last one found, or -1.
  template <class GroupOf, class FromOuter>
  int eliminate_joints(GroupOf&& group, FromOuter&& from_outer, bool with_loads) {
    ArticulatedInertia<S> Y{};
    Force<S> p{};
    int failed = -1;
    size_t branch = 0, outer = 0;
    for (int k = 0; k < length(); ++k) {
      State& s = state_[k];
      add_inertia(Y, bodies_[k].body);
      p += s.bias;
      if (is_at(branches_, branch, k) || is_at(outer_parents_, outer, k)) {
        Contribution<S> sum{};
        for (; is_at(branches_, branch, k); ++branch) {
          const PathPlace& from = branches_[branch].root;
          add_lanes<S>(sum, branches_[branch].lane, group(from).from_roots_at(from.position),
                       from.lane);
        }
        for (; is_at(outer_parents_, outer, k); ++outer)
          add_lanes<S>(sum.Y, outer_parents_[outer].lane, from_outer(outer_parents_[outer]));
        Y += sum.Y;
        p += sum.p;
      }
      EliminatedAxis<S> axis;
      const S D = eliminate<RevoluteJoint>(Y, p, 0.0, bodies_[k].stand_in, s.tau, axis);
      for (int l = 0; l < lanes; ++l)
        if (__builtin_expect(!(lane(D, l) > 0), 0)) failed = std::max(failed, index_[k].body[l]);
      store(s.axis.U, axis.U);
      s.axis.D_inverse = axis.D_inverse;
      s.axis.h = axis.h;
      PlanarInertia<S> Ya;
      reduce<RevoluteJoint>(Y, axis, RevoluteJoint::bias(s.velocity, 0.0, s.rate), Ya, p);
      if (with_loads) {
        store(reduced_[k].Y, Ya);
        store(reduced_[k].p, p);
      }
      const auto place = bodies_.place(k, s.turn);
      Y = place.to_parent(Ya);
      p = place.to_parent(p);
      if (root_at_[k] >= 0) from_root_[root_at_[k]] = {Y, p};
    }
    return failed;
  }

  /// parent(root): the acceleration of the body that carries the path.
  template <class ParentMotion>
  void accelerate_bodies(ParentMotion&& parent, double* du, bool with_loads) {
    Motion<S> a{};
    size_t root = roots_.size();
    for (int k = length() - 1; k >= 0; --k) {
      State& s = state_[k];
      enter(k, root, parent, a);
      a = bodies_.place(k, s.turn).to_child(a);
      if (with_loads) store(reduced_[k].joint_load, outward_load(reduced_[k].Y, reduced_[k].p, a));
      const Motion<S> c = RevoluteJoint::bias(s.velocity, 0.0, s.rate);
      const S rate = accelerate<RevoluteJoint>(s.axis, c, 0.0, a);
      for (int l = 0; l < lanes; ++l)
        if (const int i = index_[k].v[l]; i >= 0) du[i] = lane(rate, l);
      store(s.acceleration, a);
    }
  }

 private:
  struct Index {
    std::array<int, lanes> body, q, v;
  };
  // Unions over time as in tree_sweeps.hpp.
  struct State {
    LaneTurn<S> turn;
    S rate, tau;
    union {  // its velocity is last read when its acceleration is found
      Motion<S> velocity;
      Motion<S> acceleration;
    };
    Force<S> bias;
    EliminatedAxis<S> axis;
    State() : velocity{} {}
  };
  /// Ya and pa, and the joint load that they give.
  struct Reduced {
    PlanarInertia<S> Y;
    union {  // pa is last read when the load is found
      Force<S> p;
      Force<S> joint_load;
    };
    Reduced() : p{} {}
  };

  static LW_INLINE S gather(const double* values, const std::array<int, lanes>& index) {
    S out{};
    for (int l = 0; l < lanes; ++l)
      if (index[l] >= 0) out[l] = values[index[l]];
    return out;
  }

  template <class List>
  static LW_INLINE bool is_at(const List& list, size_t i, int position) {
    return i < list.size() && list[i].position == position;
  }

  template <class ParentMotion>
  LW_INLINE void enter(int k, size_t& root, ParentMotion&& parent, Motion<S>& v) const {
    for (; root > 0 && roots_[root - 1].position == k; --root)
      set_lanes<S>(v, roots_[root - 1].lane, parent(roots_[root - 1]));
  }

  LaneBodies<S> bodies_;
  // From the outermost position to the innermost one, branches in the order of their sums.
  std::vector<Root> roots_;
  std::vector<Branch> branches_;
  std::vector<OuterParent> outer_parents_;
  std::vector<Index> index_;
  std::vector<State> state_;
  std::vector<Reduced> reduced_;  ///< made when loads are first asked for
  std::vector<Contribution<S>> from_root_;
  std::vector<int> root_at_;  ///< position -> index into from_root_, or -1
};

}  // namespace linkwise
