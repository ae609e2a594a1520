#include "linkwise/kinematics/loop_states.hpp"

#include <algorithm>

namespace linkwise {
namespace {

std::vector<KindRange> carriers_of_loops(const Model& model) {
  std::vector<char> carries(model.n_bodies(), 0);
  for (const LoopJoint& loop : model.loops.joints)
    for (int end : {loop.parent_body, loop.joint.body})
      for (; end >= 0 && !carries[end]; end = model.topology[end].parent) carries[end] = 1;
  std::vector<KindRange> ranges;
  for (int n = 0; n < model.n_bodies(); ++n)
    if (carries[n]) append_to_ranges(ranges, model.topology[n], n);
  return ranges;
}

/// Frame that a path starts from -> frame on the body that it leads to.
Transform<double> along(const std::vector<int>& path, const Transform<double>& X_end,
                        const std::vector<BodyState<double>>& bodies) {
  Transform<double> X = X_end;
  for (size_t i = path.size(); i-- > 0;) X = X * bodies[path[i]].X;
  return X;
}

}  // namespace

LoopPath loop_path(const Model& model, const LoopJoint& loop) {
  LoopPath path;
  int a = loop.parent_body, b = loop.joint.body;
  while (a != b) {  // the one with the higher number is no ancestor of the other
    int& outer = a > b ? a : b;
    (a > b ? path.to_a : path.to_b).push_back(outer);
    outer = model.topology[outer].parent;
  }
  path.meets = a;
  std::reverse(path.to_a.begin(), path.to_a.end());
  std::reverse(path.to_b.begin(), path.to_b.end());
  return path;
}

LoopStates::LoopStates(const Model& model)
    : model_(model),
      carriers_(carriers_of_loops(model)),
      bodies_(model.n_bodies()),
      general_(model.n_general),
      loops_(model.n_loops()),
      start_(model.loops.nq),
      q_(model.loops.nq),
      v_(model.loops.nv) {
  for (const LoopJoint& loop : model.loops.joints) paths_.push_back(loop_path(model, loop));
  for (const Element& e : model.loops.elements)
    if (const int own = info_of(e.kind).quaternion; own >= 0) start_[e.q + own + 3] = 1;
}

void LoopStates::update(const SweepInput<double>& in, const double* last) {
  calc_body_states(model_, carriers_, in, bodies_.data(), general_.data());
  std::copy_n(last ? last : start_.data(), q_.size(), q_.begin());
  for (int l = 0; l < model_.n_loops(); ++l) update_loop(in.v != nullptr, l);
}

void LoopStates::update_loop(bool moving, int l) {
  const LoopJoint& loop = model_.loops.joints[l];
  LoopState& out = loops_[l];
  const Transform<double> X_E = along(paths_[l].to_a, loop.on_parent, bodies_);
  const Transform<double> X_F = along(paths_[l].to_b, loop.on_child, bodies_);
  const Transform<double> X_FE{X_F.R * transpose(X_E.R), X_E.R * (X_F.r - X_E.r)};
  out.X_FA = X_FE * loop.on_parent;
  const std::span<const Element> stack = stack_of(model_, loop);
  closure_coordinates(stack, X_FE, q_.data());

  // The elements once without rates, for P, then with them, for c.
  SweepInput<double> at;
  at.q = q_.data();
  BodyState<double> state;
  GeneralState<double> columns;
  calc_general_state(stack, at, Motion<double>{}, state, columns);
  calc_closure_basis(columns.P, columns.n, out.basis);
  std::copy_n(columns.dof, columns.n, out.dof);
  closure_residual(out.basis, closure_gap(state.X, X_FE), out.gap);

  const Motion<double> v_a = velocity_of(loop.parent_body);
  const Vector6<double> of_b = to_array(loop.on_child * velocity_of(loop.joint.body)),
                        of_a = to_array(out.X_FA * v_a);
  Vector6<double> relative;
  for (int i = 0; i < 6; ++i) relative[i] = of_b[i] - of_a[i];
  for (int i = 0; i < columns.n; ++i)
    v_[columns.dof[i]] = linkwise::along(out.basis.dual[i], relative);
  for (int i = 0; i < out.rows(); ++i) out.slip[i] = linkwise::along(out.basis.Q[i], relative);
  at.v = moving ? v_.data() : nullptr;
  calc_general_state(stack, at, loop.on_parent * v_a, state, columns);
  out.c = state.c;
}

}  // namespace linkwise
