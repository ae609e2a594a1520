#include "linkwise/constraint/tree_system.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/exec/tiles.hpp"
#include "linkwise/kinematics/user_frames.hpp"

namespace linkwise {

TreeSystem::TreeSystem(const Model& model, const Executor& executor)
    : model_(&model),
      executor_(executor),
      state_(model.n_bodies()),
      general_(model.n_general),
      joint_(model.n_bodies()),
      known_(model.n_bodies()),
      g_(model.n_bodies()),
      w_(model.n_bodies()),
      a_(model.n_bodies()),
      off_(model.n_bodies()),
      moved_(model.n_bodies()) {
  refuse_loops(model, "A f = b of a tree");
  if (!model.own_element.empty())
    throw InputError("A f = b of a tree" + model.where() +
                     " takes rigid bodies, and this machine has flexible links; use method "
                     "constraint_force");
  require_regular_inertias(model);
  std::vector<int> parent, dim;
  const auto& armature = model.dof_values(DofProperty::armature);
  for (int n = 0; n < model.n_bodies(); ++n) {
    compliance_.push_back(compliance(model.constants[n].rigid));
    const BodyTopology& body = model.topology[n];
    parent.push_back(body.parent);
    dim.push_back(constraint_rows(model, n));
    // One-axis joints have a constant B; the others are filled in at every assembly.
    if (body.joint_kind != JointKind::general) {
      const Motion<double> P = element_column<double>(model.elements[body.first_element], 0);
      calc_joint_constraint(&P, &body.v, 1, armature, joint_[n]);
    }
  }
  A_.set_structure(parent, dim);
  b_.resize(A_.size());
}

void TreeSystem::calc_constraints() {
  const Model& model = *model_;
  if (model.n_general == 0) return;
  for (int n = 0; n < model.n_bodies(); ++n) {
    const int g = model.topology[n].general;
    if (g >= 0)
      calc_joint_constraint(general_[g].P, general_[g].dof, general_[g].n,
                            model.dof_values(DofProperty::armature), joint_[n]);
  }
}

void TreeSystem::calc_free_accelerations(const SweepInput<double>& in) {
  const Model& model = *model_;
  for (int n = 0; n < model.n_bodies(); ++n) g_[n] = {-state_[n].bias.lin, -state_[n].bias.ang};
  const auto& armature = model.dof_values(DofProperty::armature);
  for (int n = 0; n < model.n_bodies(); ++n) {
    const JointConstraint<double>& joint = joint_[n];
    Vector6<double> known{};
    for (int i = 0; i < joint.free; ++i) {
      if (armature[joint.dof[i]] > 0) continue;
      for (int r = 0; r < 6; ++r) known[r] += in.tau[joint.dof[i]] * joint.dual[i][r];
    }
    known_[n] = to_force(known.data());
    g_[n] += known_[n];
    if (const int parent = model.topology[n].parent; parent >= 0)
      g_[parent] -= transpose_times(state_[n].X, known_[n]);
  }
  for (int n = 0; n < model.n_bodies(); ++n) a_[n] = compliance_[n] * g_[n];
}

void TreeSystem::assemble_node(int n, const SweepInput<double>& in) {
  const Model& model = *model_;
  const JointConstraint<double>& joint = joint_[n];
  const int parent = model.topology[n].parent, rows = joint.rows;
  const Transform<double>& X = state_[n].X;
  const auto& armature = model.dof_values(DofProperty::armature);

  Matrix6<double> W = to_matrix(compliance_[n]), K{};
  if (parent >= 0) {
    const RigidBody<double>& carrier = model.constants[parent].rigid;
    K = compliance(carrier, compliance_[parent], X);
    const Matrix6<double> at_port = compliance(carrier, K, X);
    for (int i = 0; i < 36; ++i) W[i] += at_port[i];
  }
  Block& D = A_.diag[n];
  for (int c = 0; c < rows; ++c) {
    Vector6<double> y{};
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) y[i] += W[6 * i + j] * joint.B[c][j];
    for (int r = 0; r <= c; ++r) {
      double sum = 0;
      for (int i = 0; i < 6; ++i) sum += joint.B[r][i] * y[i];
      D[block_stride * r + c] = D[block_stride * c + r] = sum;
    }
    D[(block_stride + 1) * c] += joint.compliance[c];
  }

  const Motion<double> free_parent =
      parent >= 0 ? a_[parent] : ground_acceleration<double>(model, in.gravity_factor);
  Motion<double> relative = X * free_parent;
  relative += state_[n].c;
  relative += Motion<double>{-a_[n].lin, -a_[n].ang};
  const Vector6<double> gap = to_array(relative);
  for (int r = 0; r < rows; ++r) {
    double sum = joint.armature_of[r] >= 0
                     ? in.tau[joint.armature_of[r]] / armature[joint.armature_of[r]]
                     : 0;
    for (int i = 0; i < 6; ++i) sum += joint.B[r][i] * gap[i];
    b_[A_.offset[n] + r] = sum;
  }

  if (parent >= 0 && A_.lever_of[n] >= 0) {
    Block& H = A_.levers[A_.lever_of[n]];
    for (int r = 0; r < rows; ++r) {
      const Vector6<double> row = to_array(transpose_times(X, to_force(joint.B[r].data())));
      for (int i = 0; i < 6; ++i) H[block_stride * r + i] = row[i];
    }
  } else if (parent >= 0) {
    const JointConstraint<double>& inboard = joint_[parent];
    Block& L = A_.parent_block[n];
    for (int r = 0; r < rows; ++r) {
      Vector6<double> y{};
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) y[j] += joint.B[r][i] * K[6 * i + j];
      for (int c = 0; c < inboard.rows; ++c) {
        double sum = 0;
        for (int j = 0; j < 6; ++j) sum += y[j] * inboard.B[c][j];
        L[block_stride * r + c] = -sum;
      }
    }
  }
}

void TreeSystem::assemble(const SweepInput<double>& in) {
  calc_states([&](BodyState<double>* state, GeneralState<double>* general) {
    calc_body_states(*model_, in, state, general);
  });
  assemble_rows(in);
}

void TreeSystem::assemble_rows(const SweepInput<double>& in) {
  calc_free_accelerations(in);
  Tiles(model_->n_bodies(), TileOf::nodes).for_each(executor_, [&](int, int begin, int end) {
    for (int n = begin; n < end; ++n) assemble_node(n, in);
  });
  for (BlockTree::Hub& hub : A_.hubs) {
    hub.compliance = to_matrix(compliance_[hub.node]);
    const JointConstraint<double>& joint = joint_[hub.node];
    for (int r = 0; r < joint.rows; ++r)
      for (int i = 0; i < 6; ++i) hub.inboard[block_stride * r + i] = joint.B[r][i];
  }
}

/// Adds body n to the squares. `relative`: the acceleration across its joint, of which `open` is
/// what the joint forbids.
void TreeSystem::add_distance(int n, const SweepInput<double>& in, const std::vector<double>& f,
                              const double* du, const Motion<double>& relative,
                              const Motion<double>& open, Distance& distance) {
  const int parent = model_->topology[n].parent;
  const auto& armature = model_->dof_values(DofProperty::armature);
  const JointConstraint<double>& joint = joint_[n];
  const RigidBody<double>& body = model_->constants[n].rigid;
  for (int r = 0; r < joint.rows; ++r) {
    const int i = joint.armature_of[r];
    if (i < 0) continue;
    const double off = du[i] - (in.tau[i] - f[A_.offset[n] + r]) / armature[i];
    distance.gap += armature[i] * off * off;
    distance.size += armature[i] * du[i] * du[i];
  }
  Motion<double> off = parent >= 0 ? state_[n].X * off_[parent] : Motion<double>{};
  off = {off.lin - open.lin, off.ang - open.ang};
  off_[n] = off;
  distance.gap += dot(off, inertia_times(body, off));
  if (!distance.with_size) return;
  Motion<double> moved = parent >= 0 ? state_[n].X * moved_[parent] : Motion<double>{};
  moved += Motion<double>{relative.lin - open.lin, relative.ang - open.ang};
  moved_[n] = moved;
  distance.size += dot(moved, inertia_times(body, moved));
}

void TreeSystem::recover(const SweepInput<double>& in, const std::vector<double>& f, double* du,
                         double* loads, Distance* distance) {
  const Model& model = *model_;
  if (distance) distance->gap = distance->size = 0;
  for (int n = 0; n < model.n_bodies(); ++n) {
    Vector6<double> w = to_array(known_[n]);
    for (int r = 0; r < joint_[n].rows; ++r)
      for (int i = 0; i < 6; ++i) w[i] += f[A_.offset[n] + r] * joint_[n].B[r][i];
    w_[n] = to_force(w.data());
    g_[n] = {w_[n].lin - state_[n].bias.lin, w_[n].ang - state_[n].bias.ang};
    if (const int parent = model.topology[n].parent; parent >= 0)
      g_[parent] -= transpose_times(state_[n].X, w_[n]);
  }
  const Motion<double> ground = ground_acceleration<double>(model, in.gravity_factor);
  double worst = 0, largest = 0;
  for (int n = 0; n < model.n_bodies(); ++n) {
    const int parent = model.topology[n].parent;
    a_[n] = compliance_[n] * g_[n];
    for (double x : to_array(a_[n])) largest = std::max(largest, std::abs(x));
    Motion<double> relative = state_[n].X * (parent >= 0 ? a_[parent] : ground);
    relative += state_[n].c;
    relative = {a_[n].lin - relative.lin, a_[n].ang - relative.ang};
    const Vector6<double> gap = to_array(relative);
    for (int i = 0; i < joint_[n].free; ++i) {
      double sum = 0;
      for (int r = 0; r < 6; ++r) sum += joint_[n].dual[i][r] * gap[r];
      du[joint_[n].dof[i]] = sum;
    }
    Vector6<double> opened{};
    for (int r = 0; r < joint_[n].rows; ++r) {
      if (joint_[n].armature_of[r] >= 0) continue;
      double sum = 0;
      for (int i = 0; i < 6; ++i) sum += joint_[n].B[r][i] * gap[i];
      worst = std::max(worst, std::abs(sum));
      if (distance)
        for (int i = 0; i < 6; ++i) opened[i] += sum * joint_[n].B[r][i];
    }
    copy_prescribed(model, model.topology[n], in, du);
    if (distance) add_distance(n, in, f, du, relative, to_motion(opened.data()), *distance);
  }
  if (distance)
    *distance = {std::sqrt(distance->gap), std::sqrt(distance->size), distance->with_size};
  violation_ = largest > 0 ? worst / largest : 0;
  if (loads)
    store_joint_loads(
        model, in.q, [&](int n) -> const Force<double>& { return w_[n]; }, loads);
}

}  // namespace linkwise
