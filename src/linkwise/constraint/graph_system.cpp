#include "linkwise/constraint/graph_system.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/base/error.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/kinematics/coupling_states.hpp"
#include "linkwise/kinematics/user_frames.hpp"

namespace linkwise {
namespace {

/// Column of P of the joint that a term couples, or -1 where its motion is given.
int column_of(const Model& model, const Coupling::Term& term) {
  if (term.closes) {
    const JointInfo& joint = model.joint_at(term.joint);
    return model.loops.elements[joint.first_element].prescribed ? -1 : 0;
  }
  const BodyTopology& body = model.topology[term.body];
  int column = 0;
  for (int i = 0; i < body.n_elements; ++i) {
    const Element& e = model.elements[body.first_element + i];
    if (e.prescribed) continue;
    if (e.v == term.v) return column;
    column += e.nv;
  }
  return -1;
}

const LoopJoint& loop_of(const Model& model, const Coupling::Term& term) {
  return model.loops.joints[term.joint - model.n_joints()];
}

}  // namespace

BlockGraph make_constraint_graph(const Model& model) {
  std::vector<int> dims;
  std::vector<std::vector<int>> hubs;
  const auto node = [&](int rows) {
    dims.push_back(rows);
    hubs.push_back({});
  };
  const auto end_on = [&](int body) {
    if (body >= 0 && std::find(hubs.back().begin(), hubs.back().end(), body) == hubs.back().end())
      hubs.back().push_back(body);
  };
  for (int n = 0; n < model.n_bodies(); ++n) {
    node(constraint_rows(model, n));
    end_on(n);
    end_on(model.topology[n].parent);
  }
  for (const LoopJoint& loop : model.loops.joints) {
    node(loop_rows(model, loop));
    end_on(loop.joint.body);
    end_on(loop.parent_body);
  }
  for (const Coupling& coupling : model.couplings) {
    node(1);
    for (const Coupling::Term& term : coupling.terms) {
      if (column_of(model, term) < 0) continue;
      end_on(term.body);
      end_on(term.closes ? loop_of(model, term).parent_body : model.topology[term.body].parent);
    }
  }
  BlockGraph graph;
  graph.set_structure(dims, hubs);
  return graph;
}

std::string refusal_of_graph(const Model& model) {
  if (const int body = model.singular_body(); body >= 0) return singular_inertia(model, body);
  for (const LoopJoint& loop : model.loops.joints)
    if (loop.parent_body == loop.joint.body)
      return "joint '" + loop.joint.name + "'" + model.where() +
             " joins links that move as one, which method constraint_force does not take; remove "
             "it, or use method articulated_body";
  return "";
}

GraphSystem::GraphSystem(const Model& model)
    : model_(&model),
      state_(model.n_bodies()),
      general_(model.n_general),
      joint_(model.n_bodies()),
      loops_(model),
      g_(model.n_bodies()),
      known_(model.n_bodies()),
      known_of_loop_(model.n_loops()),
      w_(model.n_bodies()),
      loop_w_(model.n_loops()),
      a_(model.n_bodies()) {
  if (const std::string why = refusal_of_graph(model); !why.empty()) throw InputError(why);
  A_ = make_constraint_graph(model);
  for (const Coupling& coupling : model.couplings) {
    columns_.push_back({});
    for (const Coupling::Term& term : coupling.terms)
      columns_.back().push_back(column_of(model, term));
    slopes_.push_back(std::vector<double>(coupling.terms.size()));
  }
  for (auto* x : {&b_, &r_, &size_}) x->resize(A_.size());
  for (int n = 0; n < model.n_bodies(); ++n) {
    compliance_.push_back(compliance(model.constants[n].rigid));
    A_.compliance[n] = to_matrix(compliance_[n]);
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

void GraphSystem::put(int node, int r, int body, const Force<double>& wrench) {
  if (body < 0) {
    const double known = dot(ground_, wrench);
    r_[A_.offset[node] + r] -= known;
    size_[A_.offset[node] + r] += std::abs(known);
    return;
  }
  int which = 0;
  while (A_.end_hub[A_.node_ends[A_.node_begin[node] + which]] != body) ++which;
  const Vector6<double> w = to_array(wrench);
  double* const row = A_.lever(node, which, r);
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
  const JointConstraint<double>& joint = joint_[n];
  const int parent = model_->topology[n].parent;
  for (int r = 0; r < joint.rows; ++r) {
    const Force<double> B = to_force(joint.B[r].data());
    const Force<double> reaction = transpose_times(state_[n].X, B);
    put(n, r, n, B);
    put(n, r, parent, {-reaction.lin, -reaction.ang});
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

void GraphSystem::finish_b() {
  for (int n = 0; n < model_->n_bodies(); ++n) a_[n] = compliance_[n] * g_[n];
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
    Vector6<double> w = to_array(g_[n]);
    for (int e = A_.hub_begin[n]; e < A_.hub_begin[n + 1]; ++e) {
      const double* row = A_.levers.data() + A_.lever_begin[e];
      const int node = A_.end_node[e];
      for (int r = A_.offset[node]; r < A_.offset[node + 1]; ++r, row += 6)
        for (int k = 0; k < 6; ++k) w[k] += f[r] * row[k];
    }
    a_[n] = compliance_[n] * to_force(w.data());
  }
}

Vector6<double> GraphSystem::relative_acceleration(int n) const {
  const int parent = model_->topology[n].parent;
  Motion<double> of_parent = state_[n].X * (parent >= 0 ? a_[parent] : ground_);
  if (with_bias_) of_parent += state_[n].c;
  return to_array(Motion<double>{a_[n].lin - of_parent.lin, a_[n].ang - of_parent.ang});
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
  }
  calc_violation();
  if (loads) store_loads(in.q, loads);
}

/// sum_k G_ik a_k in row r of node i.
double GraphSystem::row_of_accelerations(int i, int r) const {
  double sum = 0;
  for (int at = A_.node_begin[i]; at < A_.node_begin[i + 1]; ++at) {
    const int e = A_.node_ends[at];
    const Vector6<double> a = to_array(a_[A_.end_hub[e]]);
    const double* const row = A_.levers.data() + A_.lever_begin[e] + 6 * size_t(r - A_.offset[i]);
    for (int k = 0; k < 6; ++k) sum += row[k] * a[k];
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
  for (const Motion<double>& a : a_)
    for (const double x : to_array(a)) largest = std::max(largest, std::abs(x));
  violation_ = largest > 0 ? worst / largest : 0;
}

/// a_ by du alone, and what joints of the tree transmit then: w_.
void GraphSystem::calc_motion(const double* du) {
  const Model& model = *model_;
  for (int n = 0; n < model.n_bodies(); ++n) {
    const BodyTopology& body = model.topology[n];
    Motion<double> a = state_[n].X * (body.parent >= 0 ? a_[body.parent] : ground_);
    a += state_[n].c;
    const auto add = [&](const Motion<double>& P, double x) { a += x * P; };
    if (body.general >= 0) {
      const GeneralState<double>& joint = general_[body.general];
      for (int k = 0; k < joint.n; ++k) add(joint.P[k], du[joint.dof[k]]);
    } else {
      add(element_column<double>(model.elements[body.first_element], 0), du[body.v]);
    }
    a_[n] = a;
    w_[n] = inertia_times(model.constants[n].rigid, a);
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
  for (const Motion<double>& a : a_)
    for (const double x : to_array(a)) largest = std::max(largest, std::abs(x));
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
  }
  for (size_t i = 0; i < f.size(); ++i) f[i] += df[i];
  if (loads) store_loads(in.q, loads);
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
