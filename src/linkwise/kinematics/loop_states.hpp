#pragma once
// The joints that close loops, at a state of the tree. Frame E is fixed in body a, F in body b, and
// the pose of F in E follows from the tree's coordinates. Of the joint between them
//     q_l = what comes closest,   u_l = P^+ v_rel,   v_rel = X_F v_b - X_FA v_a,   X_FA = X_FE X_E
//     0 = G_a v_a + G_b v_b,      G_b = Q^T X_F,     G_a = -Q^T X_FA
//     r = G_a a_a + G_b a_b,      r = Q^T c
// with P, Q and c of the same stack of elements that a tree joint would have (joints/closure.hpp).
// A joint of given motion has q_l and u_l from outside, no P, and what they miss is a gap. A rotor
// of inertia I along coordinate k is a row of its own, P^+T_k, whose force s = -I du_k makes it
// yield by s / I.
// What is left of the pose is the gap, which is closed in a state that is consistent. A rod has no
// P, and Q is the one direction n from E to F. A spring has no Q, and P^+T is n.
#include <compare>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "linkwise/joints/closure.hpp"
#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

/// Where a loop runs: from the innermost body of the loop outward to the two that its joint joins.
struct LoopPath {
  int meets = -1;               ///< both paths start from this body; -1: from the ground
  std::vector<int> to_a, to_b;  ///< bodies farther out, base to tip
};
LoopPath loop_path(const Model& model, const LoopJoint& loop);

inline std::span<const Element> stack_of(const Model& model, const LoopJoint& loop) {
  return {model.loops.elements.data() + loop.joint.first_element,
          static_cast<size_t>(loop.joint.n_elements)};
}

/// Rows of a loop joint: directions that it holds, then its rotors.
int loop_rows(const Model& model, const LoopJoint& loop);
/// Coordinates of a loop joint that turn a rotor.
int loop_rotors(const Model& model, const LoopJoint& loop);

/// One loop joint. Everything is in F's axes, at F.
struct LoopState {
  Transform<double> X_FA;  ///< body a's frame, or the ground's -> F
  ClosureBasis basis;      ///< P^+T and Q
  int dof[6];              ///< of the columns of P, as loop joints count them
  int held;                ///< directions that the joint holds: rows of Q
  int rows;                ///< these, then one per rotor
  Vector6<double> row[6];  ///< direction of each: of Q, then of P^+T
  double yields[6];        ///< by a unit of force: 1 / I of a rotor, else 0
  double r[6];             ///< row . c
  Vector6<double> c;       ///< relative acceleration of F that no acceleration of the joint makes
  double bias;             ///< P^+ c of a joint of one axis
  double gap[6];           ///< position residual g [held]; 0 of rotors
  double slip[6];          ///< Q^T v_rel [held]: the rate of g where the gap is closed
  double speed;            ///< of the faster one of E and F at F, m/s; turns count by the length
  double length;           ///< m: how far the loop reaches, by which turns are compared
  double relative_gap;     ///< over the length
  double relative_slip;    ///< over length and speed
};

/// What a sweep knows of the bodies that a loop joint joins: their frames against that of the body
/// where the loop meets, and their velocities.
struct LoopEnds {
  Transform<double> X_a, X_b;
  Motion<double> v_a, v_b;
};

class LoopStates {
 public:
  /// A body: parent's frame -> its own, and its velocity.
  struct Moving {
    Transform<double> X;
    Motion<double> v;
  };

  explicit LoopStates(const Model& model);

  void update(const SweepInput<double>& in);
  /// The same where the ends of all loops are known, [n_loops].
  void update(const SweepInput<double>& in, const LoopEnds* ends);
  /// The same where the bodies' motion is known: pose(n) in the parent's frame, velocity(n).
  template <class Pose, class Velocity>
  void update(const SweepInput<double>& in, Pose&& pose, Velocity&& velocity) {
    begin(in);
    for (size_t i = 0; i < stations_.size(); ++i) {
      const auto [body, inner] = stations_[i];
      pose_[i] = inner >= 0 ? pose(body) * pose_[inner] : pose(body);
    }
    const auto at = [&](int station) { return station >= 0 ? pose_[station] : here(); };
    for (int l = 0; l < n(); ++l) {
      const Ends& ends = ends_[l];
      update_loop(l, {at(ends.at_a), at(ends.at_b), velocity(ends.body_a), velocity(ends.body_b)});
    }
  }

  const LoopState& operator[](int l) const { return loops_[l]; }
  int n() const { return static_cast<int>(loops_.size()); }
  /// Are its P and Q constants?
  bool is_element(int l) const { return is_element_[l]; }
  const LoopPath& path(int l) const { return paths_[l]; }
  /// Coordinates and rates of all loop joints.
  const std::vector<double>& q() const { return q_; }
  const std::vector<double>& v() const { return v_; }

 private:
  /// A body on the way from where a loop meets to its ends. Loops share them.
  struct Station {
    int body, inner;  ///< inner: the one before, -1: the body where the loop meets
    auto operator<=>(const Station&) const = default;
  };
  struct Ends {
    int body_a, body_b;  ///< -1: ground
    int at_a, at_b;      ///< stations, -1: where the loop meets
  };

  int station_of(const std::vector<int>& path, std::map<Station, int>& known);
  void begin(const SweepInput<double>& in);
  static Transform<double> here() { return {Mat3<double>::identity(), {}}; }
  void update_loop(int l, const LoopEnds& ends);
  /// of_a, of_b: velocities of both bodies at F; of_E: of body a at E.
  void update_element(int l, const Transform<double>& X_FE, const Motion<double>& of_a,
                      const Motion<double>& of_b);
  void update_stack(int l, const Transform<double>& X_FE, const Motion<double>& of_a,
                    const Motion<double>& of_b, const Motion<double>& of_E);
  void update_distance(int l, const Transform<double>& X_FE, const Motion<double>& of_E,
                       const Motion<double>& of_b);
  /// Coordinates and rates of a prescribed joint, as the tree makes them.
  void follow_tree(int l, const Transform<double>& X_FE, const Vector6<double>& relative);
  void set_rows(int l);

  const Model& model_;
  std::vector<KindRange> carriers_;  ///< all bodies between the ground and loop joints
  std::vector<LoopPath> paths_;
  std::vector<Station> stations_;
  std::vector<Transform<double>> pose_;  ///< frame of the body where the loop meets -> station
  std::vector<Ends> ends_;
  std::vector<char> is_element_;  ///< joints of one element, whose P and Q are constant
  std::vector<Moving> bodies_;    ///< made where nobody else knows them
  std::vector<LoopState> loops_;
  std::vector<double> start_, q_, v_;
  std::vector<double> given_v_, given_du_;  ///< of prescribed joints, else 0
  std::vector<Element> free_;               ///< the loop joints' elements, none prescribed
  bool moving_ = false, any_given_ = false, follows_tree_ = false;
};

/// What a loop's residuals are as a shift, m or m/s, and a turn, rad or rad/s.
struct LoopMiss {
  double shift, turn;
};
LoopMiss miss_of(const LoopState& state, const double* residuals);

/// The widest gap of all loops, or slip, over its loop's length, or speed.
double widest_miss(const LoopStates& states, bool of_rates);

/// InputError naming the first loop that a state leaves open, or opens, by more than a millionth of
/// its length. `where`: begins the message.
void require_closed(const Model& model, const LoopStates& states, const std::string& where = "");

/// What wrench w of the joint on its child is on body b, and on body a, in the bodies' own frames.
inline Force<double> wrench_on_b(const LoopJoint& loop, const Force<double>& w) {
  return transpose_times(loop.on_child, w);
}
inline Force<double> wrench_on_a(const LoopState& state, const Force<double>& w) {
  const Force<double> reaction = transpose_times(state.X_FA, w);
  return {-reaction.lin, -reaction.ang};
}

}  // namespace linkwise
