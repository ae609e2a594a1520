#pragma once
// What every sweep is given.

namespace linkwise {

class LoopStates;
class LoopListener;

/// Inputs of a sweep, lanes interleaved: q[nq], v[nv], tau[nv] of scalars S.
template <class S>
struct SweepInput {
  const S* q = nullptr;
  const S* v = nullptr;
  const S* tau = nullptr;
  /// Wrench on each body at its joint frame, user axes, [n_joints][6]; null: none.
  const S* external = nullptr;
  /// Acceleration of prescribed degrees of freedom, [nv]; null: zero.
  const S* prescribed = nullptr;
  /// Torques of loop joints, [nv] of theirs; null: none.
  const S* loop_tau = nullptr;
  /// Coordinates of loop joints, [nq] of theirs: those of prescribed ones are given, and angles of
  /// the others are continued from here, so that turns are counted. Null: angles are continued from
  /// zero, and prescribed loop joints stand and move as the tree makes them.
  const S* loop_q = nullptr;
  /// Rates, beside loop_q, and accelerations of prescribed loop joints, [nv] of loop joints; null:
  /// zero. loop_du is to loop joints what `prescribed` is to those of the tree.
  const S* loop_v = nullptr;
  const S* loop_du = nullptr;
  /// Who wants to know the loop joints' states; a method that does not find them itself leaves this
  /// alone (DynamicsMethod::finds_loops).
  LoopListener* on_loops = nullptr;
  /// Times the model's gravity; 0 leaves it out.
  double gravity_factor = 1;
  /// Times what bearings do not fit by; 0 leaves it out.
  double misfit_factor = 1;
};

/// Told of loop joints before anything acts on them: it may give them torques, or throw.
class LoopListener {
 public:
  virtual void found(const LoopStates& loops, SweepInput<double>& in) = 0;

 protected:
  ~LoopListener() = default;
};

}  // namespace linkwise
