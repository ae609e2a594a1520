#include "linkwise/constraint/graph_system.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/base/error.hpp"
#include "linkwise/constraint/constraint_graph.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/kinematics/coupling_states.hpp"
#include "linkwise/kinematics/user_frames.hpp"

namespace linkwise {

GraphSystem::GraphSystem(const Model& model)
    : model_(&model),
      boxes_(model),
      state_(model.n_bodies()),
      general_(model.n_general),
      joint_(model.n_bodies()),
      loops_(model),
      g_(model.n_bodies()),
      known_(model.n_bodies()),
      known_of_loop_(model.n_loops()),
      w_(model.n_bodies()),
      loop_w_(model.n_loops()) {
  if (const std::string why = refusal_of_graph(model); !why.empty()) throw InputError(why);
  A_ = make_constraint_graph(model);
  a_.resize(A_.motion_begin.back());
  for (const Coupling& coupling : model.couplings) {
    columns_.push_back({});
    for (const Coupling::Term& term : coupling.terms)
      columns_.back().push_back(column_of(model, term));
    slopes_.push_back(std::vector<double>(coupling.terms.size()));
  }
  for (auto* x : {&b_, &r_, &size_}) x->resize(A_.size());
  for (int n = 0; n < model.n_bodies(); ++n) {
    is_massless_.push_back(is_massless_on_port(model, n));
    if (!is_massless_[n] && !boxes_.has(n)) {
      const Matrix6<double> C = to_matrix(compliance(model.constants[n].rigid));
      std::copy(C.begin(), C.end(), A_.compliance(n));
    }
    const BodyTopology& body = model.topology[n];
    if (body.joint_kind == JointKind::general) continue;
    const Motion<double> P = element_column<double>(model.elements[body.first_element], 0);
    calc_joint_constraint(&P, &body.v, 1, model.dof_values(DofProperty::armature), joint_[n]);
  }
}

int GraphSystem::body_of_node(int node) const {
  const Model& model = *model_;
  if (node < model.n_bodies()) return node;
  if (node < node_of_coupling(0)) {
    const LoopJoint& loop = model.loops.joints[node - node_of_loop(0)];
    return std::max(loop.joint.body, loop.parent_body);
  }
  return model.couplings[node - node_of_coupling(0)].terms[0].body;
}

GraphSystem::Site GraphSystem::site_of(int body) const {
  if (body < 0 || !is_massless_[body]) return {body, 0};
  return {model_->topology[body].parent, 6};
}

GraphSystem::Site GraphSystem::site_inboard(int n) const {
  const BodyTopology& body = model_->topology[n];
  if (body.parent >= 0 && boxes_.has(body.parent) && on_port(*model_, body))
    return {body.parent, 6};
  return site_of(body.parent);
}

void GraphSystem::put(int node, int r, const Site& at, const Force<double>& wrench) {
  if (at.hub < 0) {
    const double known = dot(ground_, wrench);
    r_[A_.offset[node] + r] -= known;
    size_[A_.offset[node] + r] += std::abs(known);
    return;
  }
  int which = 0;
  while (A_.end_hub[A_.node_ends[A_.node_begin[node] + which]] != at.hub) ++which;
  const Vector6<double> w = to_array(wrench);
  double* const row = A_.lever(node, which, r) + at.first;
  for (int i = 0; i < 6; ++i) row[i] += w[i];
}

void GraphSystem::ask(int node, int r, double of_row) {
  r_[A_.offset[node] + r] += of_row;
  size_[A_.offset[node] + r] += std::abs(of_row);
}

void GraphSystem::assemble(const SweepInput<double>& in, const double* asked) {
  const Model& model = *model_;
  with_bias_ = true;
  calc_body_states(model, in, state_.data(), general_.data());
  loops_.update(in);
  for (int n = 0; n < model.n_bodies(); ++n)
    if (const int g = model.topology[n].general; g >= 0)
      calc_joint_constraint(general_[g].P, general_[g].dof, general_[g].n,
                            model.dof_values(DofProperty::armature), joint_[n]);
  ground_ = ground_acceleration<double>(model, in.gravity_factor);
  std::fill(A_.levers.begin(), A_.levers.end(), 0.0);
  std::fill(r_.begin(), r_.end(), 0.0);
  std::fill(size_.begin(), size_.end(), 0.0);
  is_regular_ = true;
  for (int n = 0; n < model.n_bodies(); ++n)
    if (boxes_.has(n)) {
      is_regular_ &= boxes_.update(in, n, state_, A_.compliance(n));
      boxes_.set_forces(in, n);
    }
  for (int n = 0; n < model.n_bodies(); ++n) assemble_joint(n, in.tau);
  for (int l = 0; l < model.n_loops(); ++l) assemble_loop(l, asked);
  for (int c = 0; c < model.n_couplings(); ++c) assemble_coupling(c, in, asked);
  for (int n = 0; n < model.n_bodies(); ++n) g_[n] = {-state_[n].bias.lin, -state_[n].bias.ang};
  apply_torques(in.tau);
  apply_loop_torques(in);
  asked_ = r_;
  given_ground_ = ground_;
  finish_b();
}

void GraphSystem::assemble_joint(int n, const double* tau) {
  if (is_massless_[n]) return;
  const JointConstraint<double>& joint = joint_[n];
  const Site inboard = site_inboard(n);
  const bool is_welded = inboard.first > 0 && on_port(*model_, model_->topology[n]);
  for (int r = 0; r < joint.rows; ++r) {
    const Force<double> B = to_force(joint.B[r].data());
    const Force<double> reaction = is_welded ? B : transpose_times(state_[n].X, B);
    put(n, r, n, B);
    put(n, r, inboard, {-reaction.lin, -reaction.ang});
    if (is_welded) continue;  // c is in the port's motion
    A_.own[A_.offset[n] + r] = joint.compliance[r];
    ask(n, r, dot(state_[n].c, B));
    if (joint.armature_of[r] >= 0) ask(n, r, tau[joint.armature_of[r]] * joint.compliance[r]);
  }
}

void GraphSystem::assemble_loop(int l, const double* asked) {
  const LoopState& loop = loops_[l];
  const LoopJoint& at = model_->loops.joints[l];
  const int node = node_of_loop(l);
  for (int r = 0; r < loop.rows; ++r) {
    const Force<double> Q = to_force(loop.row[r].data());
    put(node, r, at.joint.body, wrench_on_b(at, Q));
    put(node, r, at.parent_body, wrench_on_a(loop, Q));
    A_.own[A_.offset[node] + r] = loop.yields[r];
    ask(node, r, asked ? asked[6 * l + r] : loop.r[r]);
  }
}

void GraphSystem::assemble_coupling(int c, const SweepInput<double>& in, const double* asked) {
  const Coupling& coupling = model_->couplings[c];
  const int node = node_of_coupling(c);
  const CoupledState at = coupled_state(in.q, in.v, loops_);
  for (size_t t = 0; t < coupling.terms.size(); ++t) {
    const Coupling::Term& term = coupling.terms[t];
    slopes_[c][t] = term.slope(at.position(term));
    const double* const given = term.closes ? in.loop_du : in.prescribed;
    if (columns_[c][t] >= 0)
      place_term(c, t);
    else if (given && !asked)
      ask(node, 0, -slopes_[c][t] * given[term.v]);
  }
  ask(node, 0,
      asked ? asked[6 * static_cast<size_t>(model_->n_loops()) + c] : -miss_of(coupling, at).bend);
}

/// du = P^+ of the relative acceleration less P^+ c.
void GraphSystem::place_term(int c, size_t t) {
  const Coupling::Term& term = model_->couplings[c].terms[t];
  const int node = node_of_coupling(c);
  const double slope = slopes_[c][t];
  if (term.closes) {
    const LoopState& loop = loops_[term.joint - model_->n_joints()];
    const LoopJoint& at = loop_of(*model_, term);
    const Force<double> pull = slope * to_force(loop.basis.dual[0].data());
    put(node, 0, at.joint.body, wrench_on_b(at, pull));
    put(node, 0, at.parent_body, wrench_on_a(loop, pull));
    ask(node, 0, slope * loop.bias);
    return;
  }
  const BodyState<double>& state = state_[term.body];
  const Force<double> pull = slope * to_force(joint_[term.body].dual[columns_[c][t]].data());
  put(node, 0, term.body, pull);
  put(node, 0, model_->topology[term.body].parent, -1.0 * transpose_times(state.X, pull));
  ask(node, 0, dot(state.c, pull));
}

void GraphSystem::apply_torques(const double* tau) {
  const auto& armature = model_->dof_values(DofProperty::armature);
  for (int n = 0; n < model_->n_bodies(); ++n) {
    const JointConstraint<double>& joint = joint_[n];
    Vector6<double> known{};
    for (int i = 0; i < joint.free; ++i) {
      if (armature[joint.dof[i]] > 0) continue;
      for (int r = 0; r < 6; ++r) known[r] += tau[joint.dof[i]] * joint.dual[i][r];
    }
    known_[n] = to_force(known.data());
    g_[n] += known_[n];
    if (const int parent = model_->topology[n].parent; parent >= 0)
      g_[parent] -= transpose_times(state_[n].X, known_[n]);
  }
}

/// What is given, less what rotors of turning rates take by themselves.
void GraphSystem::apply_loop_torques(const SweepInput<double>& in) {
  const Model& model = *model_;
  tau_.assign(model.loops.nv, 0.0);
  if (in.loop_tau) std::copy_n(in.loop_tau, tau_.size(), tau_.begin());
  if (in.v && has_armature_bias(model.loops))
    add_armature_bias(model.loops, loops_.v().data(), -1, tau_.data());
  for (int l = 0; l < model.n_loops(); ++l) {
    const LoopState& loop = loops_[l];
    Force<double>& w = known_of_loop_[l] = {};
    for (int k = 0; k < loop.basis.n; ++k)
      w += tau_[loop.dof[k]] * to_force(loop.basis.dual[k].data());
    const LoopJoint& at = model.loops.joints[l];
    if (at.parent_body >= 0) g_[at.parent_body] += wrench_on_a(loop, w);
    if (at.joint.body >= 0) g_[at.joint.body] += wrench_on_b(at, w);
  }
}

void GraphSystem::known_wrenches(int n, double* w) const {
  const Vector6<double> own = to_array(g_[n]);
  std::copy(own.begin(), own.end(), w);
  if (!boxes_.has(n)) return;
  const int carried = boxes_.carried_by(n);
  Vector6<double> on_port{};
  if (carried >= 0 && is_massless_[carried]) on_port = to_array(g_[carried]);
  std::copy(on_port.begin(), on_port.end(), w + 6);
}

void GraphSystem::accelerate(int n, const double* w) {
  double* const a = motion({n, 0});
  const double* const C = A_.compliance(n);
  if (boxes_.has(n)) return boxes_.accelerate(n, C, w, a);
  for (int i = 0; i < 6; ++i) {
    a[i] = 0;
    for (int j = 0; j < 6; ++j) a[i] += C[6 * i + j] * w[j];
  }
}

void GraphSystem::finish_b() {
  for (int n = 0; n < model_->n_bodies(); ++n) {
    if (is_massless_[n]) continue;
    double w[12];
    known_wrenches(n, w);
    accelerate(n, w);
  }
  for (int i = 0; i < A_.n(); ++i)
    for (int r = A_.offset[i]; r < A_.offset[i + 1]; ++r) {
      const double sum = row_of_accelerations(i, r);
      b_[r] = r_[r] - sum;
      size_[r] += std::abs(sum);
    }
}

void GraphSystem::add_forces(const std::vector<double>& f) {
  const Model& model = *model_;
  for (int n = 0; n < model.n_bodies(); ++n)
    for (int r = 0; r < joint_[n].rows; ++r)
      w_[n] += f[A_.offset[n] + r] * to_force(joint_[n].B[r].data());
  for (int l = 0; l < model.n_loops(); ++l)
    for (int r = 0; r < loops_[l].rows; ++r)
      loop_w_[l] += f[A_.offset[node_of_loop(l)] + r] * to_force(loops_[l].row[r].data());
  for (int c = 0; c < model.n_couplings(); ++c)
    for (size_t t = 0; t < slopes_[c].size(); ++t) {
      if (columns_[c][t] < 0) continue;
      const Coupling::Term& term = model.couplings[c].terms[t];
      const double torque = f[A_.offset[node_of_coupling(c)]] * slopes_[c][t];
      if (term.closes) {
        const int l = term.joint - model.n_joints();
        loop_w_[l] += torque * to_force(loops_[l].basis.dual[0].data());
      } else {
        w_[term.body] += torque * to_force(joint_[term.body].dual[columns_[c][t]].data());
      }
    }
}

void GraphSystem::calc_accelerations(const std::vector<double>& f) {
  for (int n = 0; n < model_->n_bodies(); ++n) {
    if (is_massless_[n]) continue;
    double w[12];
    known_wrenches(n, w);
    const int width = A_.width(n);
    for (int e = A_.hub_begin[n]; e < A_.hub_begin[n + 1]; ++e) {
      const double* row = A_.levers.data() + A_.lever_begin[e];
      const int node = A_.end_node[e];
      for (int r = A_.offset[node]; r < A_.offset[node + 1]; ++r, row += width)
        for (int k = 0; k < width; ++k) w[k] += f[r] * row[k];
    }
    accelerate(n, w);
  }
}

Vector6<double> GraphSystem::relative_acceleration(int n) const {
  const int parent = model_->topology[n].parent;
  Motion<double> of_parent = state_[n].X * (parent >= 0 ? acceleration(parent) : ground_);
  if (with_bias_) of_parent += state_[n].c;
  const Motion<double> own = acceleration(n);
  return to_array(Motion<double>{own.lin - of_parent.lin, own.ang - of_parent.ang});
}

void GraphSystem::recover(const SweepInput<double>& in, const std::vector<double>& f, double* du,
                          double* loads) {
  w_ = known_;
  loop_w_ = known_of_loop_;
  add_forces(f);
  calc_accelerations(f);
  for (int n = 0; n < model_->n_bodies(); ++n) {
    const Vector6<double> relative = relative_acceleration(n);
    for (int i = 0; i < joint_[n].free; ++i) {
      double sum = 0;
      for (int r = 0; r < 6; ++r) sum += joint_[n].dual[i][r] * relative[r];
      du[joint_[n].dof[i]] = sum;
    }
    copy_prescribed(*model_, model_->topology[n], in, du);
    if (boxes_.has(n))
      std::copy_n(boxes_.accelerations(n), boxes_.count(n), du + own_place(*model_, n));
  }
  carry_massless();
  calc_violation();
  if (loads) store_loads(in.q, loads);
}

/// sum_k G_ik a_k in row r of node i.
double GraphSystem::row_of_accelerations(int i, int r) const {
  double sum = 0;
  for (int at = A_.node_begin[i]; at < A_.node_begin[i + 1]; ++at) {
    const int e = A_.node_ends[at];
    const int width = A_.width(A_.end_hub[e]);
    const double* const a = motion({A_.end_hub[e], 0});
    const double* const row =
        A_.levers.data() + A_.lever_begin[e] + static_cast<size_t>(width) * (r - A_.offset[i]);
    for (int k = 0; k < width; ++k) sum += row[k] * a[k];
  }
  return sum;
}

void GraphSystem::calc_violation() {
  double worst = 0, largest = 0;
  for (int i = 0; i < A_.n(); ++i)
    for (int r = A_.offset[i]; r < A_.offset[i + 1]; ++r) {
      if (A_.own[r] > 0) continue;
      worst = std::max(worst, std::abs(r_[r] - row_of_accelerations(i, r)));
    }
  for (const double x : a_) largest = std::max(largest, std::abs(x));
  violation_ = largest > 0 ? worst / largest : 0;
}

/// And of the port that carries a body.
void GraphSystem::set_acceleration(int n, const Motion<double>& a) {
  const Vector6<double> x = to_array(a);
  std::copy(x.begin(), x.end(), motion(site_of(n)));
  if (on_port(*model_, model_->topology[n])) std::copy(x.begin(), x.end(), motion(site_inboard(n)));
}

/// a_ by du alone, and what joints of the tree transmit then: w_.
void GraphSystem::calc_motion(const double* du) {
  const Model& model = *model_;
  for (int n = 0; n < model.n_bodies(); ++n) {
    const BodyTopology& body = model.topology[n];
    Motion<double> a = state_[n].X * (body.parent >= 0 ? acceleration(body.parent) : ground_);
    a += state_[n].c;
    const auto add = [&](const Motion<double>& P, double x) { a += x * P; };
    if (body.general >= 0) {
      const GeneralState<double>& joint = general_[body.general];
      for (int k = 0; k < joint.n; ++k) add(joint.P[k], du[joint.dof[k]]);
      if (on_port(model, body))
        boxes_.add_port_rate(body.parent, du + own_place(model, body.parent), a);
    } else {
      add(element_column<double>(model.elements[body.first_element], 0), du[body.v]);
    }
    set_acceleration(n, a);
    w_[n] = boxes_.has(n) ? boxes_.inertia_times(n, a, du + own_place(model, n))
                          : inertia_times(model.constants[n].rigid, a);
    w_[n] += state_[n].bias;
  }
  for (int l = 0; l < model.n_loops(); ++l) {
    const LoopJoint& at = model.loops.joints[l];
    if (at.parent_body >= 0) w_[at.parent_body] -= wrench_on_a(loops_[l], loop_w_[l]);
    if (at.joint.body >= 0) w_[at.joint.body] -= wrench_on_b(at, loop_w_[l]);
  }
  for (int n = model.n_bodies(); n-- > 0;)
    if (const int parent = model.topology[n].parent; parent >= 0)
      w_[parent] += transpose_times(state_[n].X, w_[n]);
}

/// Into tau_: by how much the torques at hand are more than what the joints transmit and their
/// rotors take.
void GraphSystem::calc_torques_missed(const SweepInput<double>& in, const std::vector<double>& f,
                                      const double* du) {
  const Model& model = *model_;
  const auto& armature = model.dof_values(DofProperty::armature);
  tau_.assign(model.nv(), 0.0);
  for (int n = 0; n < model.n_bodies(); ++n) {
    const BodyTopology& body = model.topology[n];
    const auto add = [&](const Motion<double>& P, int v) {
      tau_[v] = in.tau[v] - armature[v] * du[v] - dot(P, w_[n]);
    };
    if (body.general >= 0) {
      const GeneralState<double>& joint = general_[body.general];
      for (int k = 0; k < joint.n; ++k) add(joint.P[k], joint.dof[k]);
    } else {
      add(element_column<double>(model.elements[body.first_element], 0), body.v);
    }
    if (!boxes_.has(n)) continue;
    const int v = own_place(model, n), carried = boxes_.carried_by(n);
    const Force<double> w_port = carried >= 0 ? -1.0 * w_[carried] : Force<double>{};
    boxes_.calc_forces_missed(in, n, acceleration(n), du + v, w_port, tau_.data() + v);
  }
  for (int c = 0; c < model.n_couplings(); ++c)
    for (size_t t = 0; t < slopes_[c].size(); ++t)
      if (const Coupling::Term& term = model.couplings[c].terms[t];
          columns_[c][t] >= 0 && !term.closes)
        tau_[term.v] += slopes_[c][t] * f[A_.offset[node_of_coupling(c)]];
}

void GraphSystem::assemble_rest(const SweepInput<double>& in, const std::vector<double>& f,
                                const double* du) {
  const Model& model = *model_;
  ground_ = given_ground_;
  calc_motion(du);
  calc_torques_missed(in, f, du);
  // What is left of the rows of loops and couplings; those of the tree hold.
  for (int i = 0; i < A_.n(); ++i)
    for (int r = A_.offset[i]; r < A_.offset[i + 1]; ++r) {
      const bool of_tree = i < model.n_bodies();
      r_[r] = of_tree ? 0 : asked_[r] - A_.own[r] * f[r] - row_of_accelerations(i, r);
    }
  calc_rest();
  for (int n = 0; n < model.n_bodies(); ++n)
    for (int r = 0; r < joint_[n].rows; ++r)
      if (const int v = joint_[n].armature_of[r]; v >= 0)
        r_[A_.offset[n] + r] = tau_[v] * joint_[n].compliance[r];
  with_bias_ = false;
  ground_ = {};
  std::fill(g_.begin(), g_.end(), Force<double>{});
  for (int n = 0; n < model.n_bodies(); ++n)
    if (boxes_.has(n)) boxes_.set_forces(n, tau_.data() + own_place(model, n));
  apply_torques(tau_.data());
  std::fill(size_.begin(), size_.end(), 0.0);
  finish_b();
}

void GraphSystem::calc_rest() {
  double torque = 0, load = 0, open = 0, largest = 0;
  for (const double x : tau_) torque = std::max(torque, std::abs(x));
  for (const Force<double>& w : w_)
    for (const double x : to_array(w)) load = std::max(load, std::abs(x));
  for (int r = A_.offset[model_->n_bodies()]; r < A_.size(); ++r)
    if (A_.own[r] == 0) open = std::max(open, std::abs(r_[r]));
  for (const double x : a_) largest = std::max(largest, std::abs(x));
  rest_ = std::max(load > 0 ? torque / load : torque, largest > 0 ? open / largest : open);
}

void GraphSystem::add_rest(const SweepInput<double>& in, const std::vector<double>& df,
                           std::vector<double>& f, double* du, double* loads) {
  for (int n = 0; n < model_->n_bodies(); ++n) w_[n] += known_[n];
  add_forces(df);
  calc_accelerations(df);
  for (int n = 0; n < model_->n_bodies(); ++n) {
    const Vector6<double> relative = relative_acceleration(n);
    for (int i = 0; i < joint_[n].free; ++i)
      for (int r = 0; r < 6; ++r) du[joint_[n].dof[i]] += joint_[n].dual[i][r] * relative[r];
    if (!boxes_.has(n)) continue;
    const int v = own_place(*model_, n);
    for (int k = 0; k < boxes_.count(n); ++k) du[v + k] += boxes_.accelerations(n)[k];
  }
  carry_massless();
  for (size_t i = 0; i < f.size(); ++i) f[i] += df[i];
  if (loads) store_loads(in.q, loads);
}

void GraphSystem::carry_massless() {
  const Model& model = *model_;
  if (model.own_element.empty()) return;
  for (int n = 0; n < model.n_bodies(); ++n)
    if (is_massless_[n]) w_[n] = state_[n].bias;
  for (int l = 0; l < model.n_loops(); ++l) {
    const LoopJoint& at = model.loops.joints[l];
    if (const int a = at.parent_body; a >= 0 && is_massless_[a])
      w_[a] -= wrench_on_a(loops_[l], loop_w_[l]);
    if (const int b = at.joint.body; b >= 0 && is_massless_[b])
      w_[b] -= wrench_on_b(at, loop_w_[l]);
  }
  for (int n = model.n_bodies(); n-- > 0;)
    if (const int parent = model.topology[n].parent; parent >= 0 && is_massless_[parent])
      w_[parent] += transpose_times(state_[n].X, w_[n]);
}

void GraphSystem::store_loads(const double* q, double* loads) const {
  const Model& model = *model_;
  store_joint_loads(
      model, q, [&](int n) -> const Force<double>& { return w_[n]; }, loads);
  for (int l = 0; l < model.n_loops(); ++l) {
    const Vector6<double> user =
        to_array(inverse_transpose_times(model.loops.joints[l].joint.to_user, loop_w_[l]));
    std::copy(user.begin(), user.end(), loads + 6 * static_cast<size_t>(model.n_joints() + l));
  }
}

void GraphSystem::coupling_loads(const std::vector<double>& f, std::vector<double>& loads) const {
  loads.clear();
  for (int c = 0; c < model_->n_couplings(); ++c)
    for (const double slope : slopes_[c])
      loads.push_back(slope * f[A_.offset[node_of_coupling(c)]]);
}

}  // namespace linkwise
