#pragma once
// The steps of the constraint-force elimination for a joint of several axes or of none: its
// constrained directions B turn with the configuration, and their number is known at run time.
#include "linkwise/constraint/joint_constraint.hpp"
#include "linkwise/recursion/constraint_steps.hpp"

namespace linkwise {

template <class S>
class StackConstraint {
 public:
  /// Velocity of the body, P and B. `again`: at the position of the last call.
  void calc_state(const Model& model, const BodyTopology& body, const SweepInput<S>& in,
                  const Motion<S>& v_parent, bool again, Motion<S>& v) {
    if (again && !in.v && !in.prescribed) {
      c_ = v = {};
      return;
    }
    BodyState<S> state;
    calc_general_state(model, body, in, v_parent, state, columns_);
    X_ = state.X;
    c_ = state.c;
    v = state.v;
    if (!again)
      calc_joint_constraint(columns_.P, columns_.dof, columns_.n,
                            model.dof_values(DofProperty::armature), joint_);
  }

  /// Adds the drives' wrench to that on the body, and takes it from the parent's, which may be
  /// null.
  void add_drives(const double* armature, const S* tau, Force<S>& on_body, Force<S>* on_parent) {
    known_ = {};
    for (int i = 0; i < joint_.free; ++i) {
      const int dof = joint_.dof[i];
      if (armature[dof] > 0) continue;
      const Force<S> one = to_force(joint_.dual[i].data());
      known_ += tau[dof] * one;
    }
    on_body += known_;
    if (on_parent) *on_parent -= transpose_times(X_, known_);
  }

  /// B^T (X a_p + c - alpha) + tau / armature, zero beyond the joint's own rows.
  void calc_gap(const double* armature, const S* tau, const Motion<S>& a_parent,
                const Motion<S>& alpha, S* b) const {
    Motion<S> gap = X_ * a_parent;
    gap += c_;
    gap += Motion<S>{-alpha.lin, -alpha.ang};
    std::fill(b, b + 6, S{});
    for (int i = 0; i < joint_.rows; ++i) {
      b[i] = dot(gap, to_force(joint_.B[i].data()));
      if (const int dof = joint_.armature_of[i]; dof >= 0) b[i] = b[i] + tau[dof] / armature[dof];
    }
  }

  /// B^T Phi B + compliance, and what the parent's answer `before` adds. Rows that are missing to
  /// six are empty but for a one on the diagonal.
  void assemble(const Compliance<S>& Phi, const Compliance<S>& before, S* D, Across<S>& across) {
    Phi_ = Phi;
    across = {};
    std::fill(D, D + 21, S{});
    for (int i = 0; i < 6; ++i) D[packed(i, i)] = broadcast<S>(1);
    for (int i = 0; i < joint_.rows; ++i) {
      const Force<S> B = to_force(joint_.B[i].data());
      const Motion<S> y = Phi * B, K = before * transpose_times(X_, B), carried = X_ * K;
      const Vector6<S> row = to_array(K);
      std::copy(row.begin(), row.end(), across.K[i]);
      for (int j = 0; j <= i; ++j) {
        const Force<S> B_j = to_force(joint_.B[j].data());
        D[packed(i, j)] = dot(y, B_j);
        across.W[packed(i, j)] = dot(carried, B_j);
      }
      D[packed(i, i)] = D[packed(i, i)] + joint_.compliance[i];
    }
  }

  /// B f.
  Force<S> wrench(const S* f) const {
    Force<S> r{};
    for (int i = 0; i < joint_.rows; ++i) {
      const Force<S> B = to_force(joint_.B[i].data());
      r += f[i] * B;
    }
    return r;
  }
  Force<S> at_parent(const Force<S>& r) const { return transpose_times(X_, r); }
  const Force<S>& known() const { return known_; }
  int rows() const { return joint_.rows; }

  /// The joint's accelerations into du; returns the body's.
  Motion<S> accelerate(const Motion<S>& a_parent, const Motion<S>& alpha, const Force<S>& r,
                       S* du) const {
    Motion<S> a = X_ * a_parent;
    a += c_;
    Motion<S> gap = Phi_ * r;
    gap += alpha;
    gap += Motion<S>{-a.lin, -a.ang};
    for (int i = 0; i < joint_.free; ++i) {
      const S rate = dot(gap, to_force(joint_.dual[i].data()));
      du[joint_.dof[i]] = rate;
      a += rate * columns_.P[i];
    }
    return a;
  }

 private:
  GeneralState<S> columns_;
  Transform<S> X_;
  Motion<S> c_;
  Force<S> known_;
  Compliance<S> Phi_;  ///< of the body
  JointConstraint<S> joint_;
};

}  // namespace linkwise
