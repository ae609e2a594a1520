#include "linkwise/kinematics/loop_states.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "linkwise/base/error.hpp"

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

double size(const Vec3<double>& r) { return std::sqrt(dot(r, r)); }

double length_of(const Element& e) {
  return size(e.placement.r) + (e.kind == ElementKind::elastic ? size(e.shape->rest) : 0);
}

double length_of(const Model& model, const LoopJoint& loop, const LoopPath& path) {
  double length = size(loop.on_parent.r) + size(loop.on_child.r);
  for (const auto* bodies : {&path.to_a, &path.to_b})
    for (const int n : *bodies)
      for (int i = 0; i < model.topology[n].n_elements; ++i)
        length += length_of(model.elements[model.topology[n].first_element + i]);
  return length > 0 ? length : 1;
}

/// To three digits.
std::string rounded(double x) {
  std::ostringstream text;
  text << std::setprecision(3) << x;
  return text.str();
}

/// As calc_general_state(), of pose and velocity alone.
LoopStates::Moving moving_stack(const Model& model, const BodyTopology& body,
                                const SweepInput<double>& in, const Motion<double>& v_parent) {
  LoopStates::Moving own{{}, v_parent};
  for (int i = 0; i < body.n_elements; ++i) {
    const Element& e = model.elements[body.first_element + i];
    const Transform<double> X = element_pose(e, in.q);
    own.X = i == 0 ? X : X * own.X;
    own.v = X * own.v;
    if (!in.v) continue;
    for_columns(e, in.q, [&](int k, const Motion<double>& column) {
      own.v += Motion<double>{in.v[e.v + k] * column.lin, in.v[e.v + k] * column.ang};
    });
  }
  return own;
}

std::string named(const Model& model, int l) {
  return "joint '" + model.loops.joints[l].joint.name + "'" + model.where();
}

}  // namespace

int loop_rotors(const Model& model, const LoopJoint& loop) {
  const auto& armature = model.loops.dof[static_cast<int>(DofProperty::armature)];
  int rotors = 0;
  for (const Element& e : stack_of(model, loop))
    for (int i = e.v; !e.prescribed && i < e.v + e.nv; ++i) rotors += armature[i] > 0;
  return rotors;
}

int loop_rows(const Model& model, const LoopJoint& loop) {
  if (loop.kind == LoopKind::rod) return 1;
  if (loop.kind == LoopKind::spring) return loop_rotors(model, loop);
  int rows = 6;
  for (const Element& e : stack_of(model, loop))
    if (!e.prescribed) rows -= e.nv;
  return rows + loop_rotors(model, loop);
}

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
      loops_(model.n_loops()),
      start_(model.loops.nq),
      q_(model.loops.nq),
      v_(model.loops.nv),
      given_v_(model.loops.nv),
      given_du_(model.loops.nv),
      free_(model.loops.elements) {
  for (Element& e : free_) {
    if (const int own = info_of(e.kind).quaternion; own >= 0) start_[e.q + own + 3] = 1;
    any_given_ |= e.prescribed;
    e.prescribed = false;
  }
  std::map<Station, int> known;
  for (int l = 0; l < model.n_loops(); ++l) {
    const LoopJoint& loop = model.loops.joints[l];
    paths_.push_back(loop_path(model, loop));
    const LoopPath& path = paths_.back();
    loops_[l].length = length_of(model, loop, path);
    ends_.push_back({loop.parent_body, loop.joint.body, station_of(path.to_a, known),
                     station_of(path.to_b, known)});
    const std::span<const Element> stack = stack_of(model, loop);
    is_element_.push_back(loop.kind == LoopKind::joint && stack.size() == 1 &&
                          !stack[0].prescribed);
    if (!is_element_.back()) continue;
    Motion<double> P[6];
    for (int k = 0; k < stack[0].nv; ++k) {
      P[k] = element_column<double>(stack[0], k);
      loops_[l].dof[k] = stack[0].v + k;
    }
    calc_closure_basis(P, stack[0].nv, loops_[l].basis);
    set_rows(l);
  }
  pose_.resize(stations_.size());
}

/// The last station of a path.
int LoopStates::station_of(const std::vector<int>& path, std::map<Station, int>& known) {
  int at = -1;
  for (const int body : path) {
    const auto [found, is_new] = known.try_emplace({body, at}, static_cast<int>(stations_.size()));
    if (is_new) stations_.push_back({body, at});
    at = found->second;
  }
  return at;
}

void LoopStates::update(const SweepInput<double>& in) {
  bodies_.resize(model_.n_bodies());
  const auto velocity = [&](int n) -> const Motion<double>& { return bodies_[n].v; };
  sweep_outward(model_, carriers_, Motion<double>{}, velocity,
                [&](auto joint, int n, const Motion<double>& v_parent) {
                  using J = decltype(joint);
                  const BodyTopology& at = model_.topology[n];
                  const BodyConstants<double>& k = model_.constants[n];
                  Moving& own = bodies_[n];
                  if constexpr (is_general<J>) {
                    own = moving_stack(model_, at, in, v_parent);
                  } else {
                    own.X = J::pose(k.tree, k.pitch, in.q[at.q]);
                    own.v = own.X * v_parent;
                    J::add_rate(own.v, k.pitch, in.v ? in.v[at.v] : 0);
                  }
                });
  update(
      in, [&](int n) -> const Transform<double>& { return bodies_[n].X; },
      [&](int n) { return n >= 0 ? bodies_[n].v : Motion<double>{}; });
}

void LoopStates::update(const SweepInput<double>& in, const LoopEnds* ends) {
  begin(in);
  for (int l = 0; l < n(); ++l) update_loop(l, ends[l]);
}

/// What is given of loop joints.
void LoopStates::begin(const SweepInput<double>& in) {
  moving_ = in.v != nullptr;
  std::copy_n(in.loop_q ? in.loop_q : start_.data(), q_.size(), q_.begin());
  follows_tree_ = any_given_ && !in.loop_q;
  if (!any_given_) return;
  for (const Element& e : model_.loops.elements) {
    if (!e.prescribed) continue;
    for (int i = e.v; i < e.v + e.nv; ++i) {
      given_v_[i] = in.v && in.loop_v ? in.loop_v[i] : 0;
      given_du_[i] = in.loop_du ? in.loop_du[i] : 0;
    }
  }
}

void LoopStates::follow_tree(int l, const Transform<double>& X_FE,
                             const Vector6<double>& relative) {
  const JointInfo& joint = model_.loops.joints[l].joint;
  const std::span<const Element> stack(free_.data() + joint.first_element,
                                       static_cast<size_t>(joint.n_elements));
  closure_coordinates(stack, X_FE, q_.data());
  SweepInput<double> at;
  at.q = q_.data();
  BodyState<double> state;
  GeneralState<double> columns;
  calc_general_state(stack, at, Motion<double>{}, state, columns);
  ClosureBasis basis;
  calc_closure_basis(columns.P, columns.n, basis);
  for (int i = 0; i < columns.n; ++i)
    given_v_[columns.dof[i]] = linkwise::along(basis.dual[i], relative);
}

void LoopStates::update_loop(int l, const LoopEnds& ends) {
  const LoopJoint& loop = model_.loops.joints[l];
  LoopState& out = loops_[l];
  const Transform<double> X_E = loop.on_parent * ends.X_a, X_F = loop.on_child * ends.X_b;
  const Transform<double> X_FE{X_F.R * transpose(X_E.R), X_E.R * (X_F.r - X_E.r)};
  out.X_FA = X_FE * loop.on_parent;
  const Motion<double> of_a = out.X_FA * ends.v_a, of_b = loop.on_child * ends.v_b;
  out.speed = std::max(size(of_a.lin) + out.length * size(of_a.ang),
                       size(of_b.lin) + out.length * size(of_b.ang));
  if (is_element_[l])
    update_element(l, X_FE, of_a, of_b);
  else if (loop.kind == LoopKind::joint)
    update_stack(l, X_FE, of_a, of_b, loop.on_parent * ends.v_a);
  else
    update_distance(l, X_FE, loop.on_parent * ends.v_a, of_b);
  const LoopMiss gap = miss_of(out, out.gap), slip = miss_of(out, out.slip);
  out.relative_gap = (gap.shift + gap.turn * out.length) / out.length;
  out.relative_slip = (slip.shift + slip.turn * out.length) / (out.speed + out.length);
}

/// Rows from the basis.
void LoopStates::set_rows(int l) {
  LoopState& out = loops_[l];
  out.rows = out.held = out.basis.rows();
  for (int i = 0; i < out.held; ++i) {
    out.row[i] = out.basis.Q[i];
    out.yields[i] = 0;
  }
  const auto& armature = model_.loops.dof[static_cast<int>(DofProperty::armature)];
  for (int k = 0; k < out.basis.n; ++k) {
    const double I = armature[out.dof[k]];
    if (!(I > 0)) continue;
    const int i = out.rows++;
    out.row[i] = out.basis.dual[k];
    out.yields[i] = 1 / I;
    out.gap[i] = out.slip[i] = 0;
  }
}

/// One element. Its columns are constants in F's axes, which leaves c = (motion of E at F) x P u.
void LoopStates::update_element(int l, const Transform<double>& X_FE, const Motion<double>& of_a,
                                const Motion<double>& of_b) {
  LoopState& out = loops_[l];
  const Element& e = stack_of(model_, model_.loops.joints[l])[0];
  closure_residual(out.basis, element_gap(e, X_FE, q_.data()), out.gap);
  const Vector6<double> a = to_array(of_a), b = to_array(of_b);
  Vector6<double> relative;
  for (int i = 0; i < 6; ++i) relative[i] = b[i] - a[i];
  Motion<double> joint{};
  for (int k = 0; k < e.nv; ++k) {
    const double u = linkwise::along(out.basis.dual[k], relative);
    const auto column = element_column<double>(e, k);
    v_[e.v + k] = u;
    joint += Motion<double>{u * column.lin, u * column.ang};
  }
  const Vector6<double> c = out.c = to_array(cross(of_a, joint));
  for (int i = 0; i < out.held; ++i) out.slip[i] = linkwise::along(out.basis.Q[i], relative);
  for (int i = 0; i < out.rows; ++i) out.r[i] = linkwise::along(out.row[i], c);
  out.bias = e.nv > 0 ? linkwise::along(out.basis.dual[0], c) : 0;
}

void LoopStates::update_stack(int l, const Transform<double>& X_FE, const Motion<double>& of_a,
                              const Motion<double>& of_b, const Motion<double>& of_E) {
  const LoopJoint& loop = model_.loops.joints[l];
  LoopState& out = loops_[l];
  const std::span<const Element> stack = stack_of(model_, loop);
  const Vector6<double> a = to_array(of_a), b = to_array(of_b);
  Vector6<double> relative;
  for (int i = 0; i < 6; ++i) relative[i] = b[i] - a[i];
  if (follows_tree_ && stack[0].prescribed) follow_tree(l, X_FE, relative);
  closure_coordinates(stack, X_FE, q_.data());

  // The elements once with given rates alone, for P, then with all, for c.
  SweepInput<double> at;
  at.q = q_.data();
  at.v = given_v_.data();
  BodyState<double> state;
  GeneralState<double> columns;
  calc_general_state(stack, at, Motion<double>{}, state, columns);
  calc_closure_basis(columns.P, columns.n, out.basis);
  std::copy_n(columns.dof, columns.n, out.dof);
  set_rows(l);
  closure_residual(out.basis, closure_gap(state.X, X_FE), out.gap);

  const Vector6<double> given = to_array(state.v);
  for (int i = 0; i < 6; ++i) relative[i] -= given[i];
  for (const Element& e : stack)
    for (int i = e.v; e.prescribed && i < e.v + e.nv; ++i) v_[i] = given_v_[i];
  for (int i = 0; i < columns.n; ++i)
    v_[columns.dof[i]] = linkwise::along(out.basis.dual[i], relative);
  at.v = moving_ ? v_.data() : nullptr;
  at.prescribed = given_du_.data();
  calc_general_state(stack, at, of_E, state, columns);
  const Vector6<double> c = out.c = to_array(state.c);
  for (int i = 0; i < out.held; ++i) out.slip[i] = linkwise::along(out.basis.Q[i], relative);
  for (int i = 0; i < out.rows; ++i) out.r[i] = linkwise::along(out.row[i], c);
  out.bias = columns.n > 0 ? linkwise::along(out.basis.dual[0], c) : 0;
}

/// A rod keeps the distance of two points: their acceleration along n is -|v across n|^2 /
/// distance. That of a point is the componentwise one and w x v. A spring holds nothing. Its force
/// is along n, which is any direction where the points meet: there a spring of length 0 has no
/// force.
void LoopStates::update_distance(int l, const Transform<double>& X_FE, const Motion<double>& of_E,
                                 const Motion<double>& of_b) {
  const LoopJoint& loop = model_.loops.joints[l];
  LoopState& out = loops_[l];
  const double distance = size(X_FE.r);
  const Vec3<double> n =
      distance > 0 ? (1 / distance) * (X_FE.R * X_FE.r) : Vec3<double>{1.0, 0.0, 0.0};
  const Vec3<double> relative = of_b.lin - X_FE.R * of_E.lin;
  const Vec3<double> across = relative - dot(n, relative) * n;
  const Vec3<double> turned = cross(of_b.ang, of_b.lin) - X_FE.R * cross(of_E.ang, of_E.lin);
  const bool spring = loop.kind == LoopKind::spring;
  out.basis.n = spring ? 1 : 0;
  out.rows = out.held = spring ? 0 : 1;
  out.row[0] = {n.x, n.y, n.z, 0, 0, 0};
  out.yields[0] = 0;
  const double bent = distance > 0 ? dot(across, across) / distance : 0;
  out.r[0] = out.bias = -bent - dot(n, turned);
  out.c = {out.bias * n.x, out.bias * n.y, out.bias * n.z, 0, 0, 0};
  if (spring) {
    out.basis.dual[0] = out.row[0];
    out.dof[0] = loop.joint.v;
    q_[loop.joint.q] = distance - loop.length;
    v_[loop.joint.v] = dot(n, relative);
    const double I = model_.loops.dof[static_cast<int>(DofProperty::armature)][loop.joint.v];
    if (!(I > 0)) return;
    out.rows = 1;
    out.yields[0] = 1 / I;
    out.gap[0] = out.slip[0] = 0;
    return;
  }
  out.basis.Q[0] = out.row[0];
  out.gap[0] = distance - loop.length;
  out.slip[0] = dot(n, relative);
}

LoopMiss miss_of(const LoopState& state, const double* residuals) {
  Vector6<double> held{};
  for (int i = 0; i < state.held; ++i)
    for (int k = 0; k < 6; ++k) held[k] += residuals[i] * state.basis.Q[i][k];
  return {size({held[0], held[1], held[2]}), size({held[3], held[4], held[5]})};
}

double widest_miss(const LoopStates& states, bool of_rates) {
  double widest = 0;
  for (int l = 0; l < states.n(); ++l)
    widest = std::max(widest, of_rates ? states[l].relative_slip : states[l].relative_gap);
  return widest;
}

void require_closed(const Model& model, const LoopStates& states, const std::string& where) {
  constexpr double allowed = 1e-6;
  for (int l = 0; l < model.n_loops(); ++l) {
    const LoopState& loop = states[l];
    if (!(loop.relative_gap <= allowed)) {
      const LoopMiss gap = miss_of(loop, loop.gap);
      throw InputError(where + named(model, l) + " is open: what it joins is " +
                       rounded(1e3 * gap.shift) + " mm and " + rounded(gap.turn) +
                       " rad apart; give q that closes its loop");
    }
    if (!(loop.relative_slip <= allowed)) {
      const LoopMiss slip = miss_of(loop, loop.slip);
      throw InputError(where + named(model, l) + " opens: what it joins parts by " +
                       rounded(slip.shift) + " m/s and " + rounded(slip.turn) +
                       " rad/s; give v that keeps its loop closed");
    }
  }
}

}  // namespace linkwise
