#include "linkwise/dynamics/branch_recursion.hpp"

#include <algorithm>

#include "linkwise/exec/thread_pool.hpp"

namespace linkwise {
namespace {

void sort_in(std::vector<std::vector<int>>& levels, int level, int branch) {
  if (static_cast<int>(levels.size()) <= level) levels.resize(level + 1);
  levels[level].push_back(branch);
}

}  // namespace

BranchSchedule::BranchSchedule(const Model& model) {
  const int n_bodies = model.n_bodies();
  std::vector<int> branch_of(n_bodies);
  for (int n = 0; n < n_bodies; ++n) {
    const int parent = model.topology[n].parent;
    if (parent >= 0 && model.topology[parent].n_children == 1) {
      branch_of[n] = branch_of[parent];
    } else {
      branch_of[n] = static_cast<int>(branches.size());
      branches.emplace_back();
    }
    branches[branch_of[n]].push_back(n);
  }
  // Bodies, and so branches, come after their parents.
  std::vector<int> depth(branches.size(), 0), height(branches.size(), 0);
  const auto inboard = [&](size_t branch) {
    const int parent = model.topology[branches[branch].front()].parent;
    return parent >= 0 ? branch_of[parent] : -1;
  };
  for (size_t b = 0; b < branches.size(); ++b) {
    if (const int from = inboard(b); from >= 0) depth[b] = depth[from] + 1;
    sort_in(outward, depth[b], static_cast<int>(b));
  }
  for (size_t b = branches.size(); b-- > 0;) {
    if (const int from = inboard(b); from >= 0)
      height[from] = std::max(height[from], height[b] + 1);
    sort_in(inward, height[b], static_cast<int>(b));
  }
}

BranchRecursion::BranchRecursion(const Model& model, const DynamicsOptions& options)
    : model_(&model),
      threads_(checked_threads(options.threads)),
      schedule_(model),
      children_(model.n_bodies()),
      columns_(model),
      Y_(model.n_bodies()),
      Y_given_(model.n_bodies()),
      p_(model.n_bodies()),
      p_given_(model.n_bodies()),
      V_(columns_.count()),
      load_(model.n_bodies()),
      a_(model.n_bodies()),
      D_inverse_(columns_.count()),
      h_(columns_.count()),
      failed_(model.n_bodies()) {
  for (int n = 0; n < model.n_bodies(); ++n)
    if (const int parent = model.topology[n].parent; parent >= 0) children_[parent].push_back(n);
}

template <class Visit>
void BranchRecursion::for_branches(const std::vector<std::vector<int>>& levels, Visit&& visit) {
  for (const std::vector<int>& level : levels)
    parallel_for(static_cast<int>(level.size()), threads_,
                 [&](int i) { visit(schedule_.branches[level[i]]); });
}

/// What the body and all outboard of it resist with, in a fixed order.
void BranchRecursion::gather(int n) {
  Y_[n] = {};
  add_inertia(Y_[n], model_->constants[n].inertia);
  p_[n] = columns_.state(n).bias;
  for (int child : children_[n]) {
    Y_[n] += Y_given_[child];
    p_[n] += p_given_[child];
  }
}

/// The columns of body n from the outermost inward, each as a joint of its own.
bool BranchRecursion::eliminate(int n, const double* tau) {
  const std::vector<double>& armature = model_->dof_values(DofProperty::armature);
  ArticulatedInertia<double>& Y = Y_[n];
  Force<double>& p = p_[n];
  p += Y * columns_.state(n).c;
  for (int k = columns_.first(n + 1) - 1; k >= columns_.first(n); --k) {
    const Motion<double>& P = columns_.P(k);
    const Force<double> U = Y * P;
    const double D = dot(P, U) + armature[columns_.dof(k)];
    if (!(D > 0)) return false;
    D_inverse_[k] = 1 / D;
    V_[k] = {D_inverse_[k] * U.lin, D_inverse_[k] * U.ang};
    h_[k] = tau[columns_.dof(k)] - dot(P, p);
    subtract_outer(Y, V_[k], U);
    p += Force<double>{h_[k] * V_[k].lin, h_[k] * V_[k].ang};
  }
  if (model_->topology[n].parent >= 0) {
    Y_given_[n] = transform_to_parent(columns_.state(n).X, Y);
    p_given_[n] = transpose_times(columns_.state(n).X, p);
  }
  return true;
}

/// The columns from the innermost outward: what is left of each joint's force moves the next.
void BranchRecursion::accelerate(int n, const SweepInput<double>& in, double* du) {
  const int parent = model_->topology[n].parent;
  const Motion<double> ground = ground_acceleration<double>(*model_, in.gravity_factor);
  Motion<double> a = columns_.state(n).X * (parent >= 0 ? a_[parent] : ground);
  // Of Y and p all columns are eliminated: the wrench of the joint on the body.
  load_[n] = Y_[n] * a;
  load_[n] += p_[n];
  copy_prescribed(*model_, model_->topology[n], in, du);
  for (int k = columns_.first(n); k < columns_.first(n + 1); ++k) {
    const double rate = D_inverse_[k] * h_[k] - dot(a, V_[k]);
    const Motion<double>& P = columns_.P(k);
    a += Motion<double>{rate * P.lin, rate * P.ang};
    du[columns_.dof(k)] = rate;
  }
  a += columns_.state(n).c;
  a_[n] = a;
}

DynamicsReport BranchRecursion::evaluate(double, const SweepInput<double>& in, double* du,
                                         double* loads) {
  const Model& model = *model_;
  for_branches(schedule_.outward, [&](const std::vector<int>& branch) {
    for (int n : branch) columns_.update_body(in, n);
  });
  if (in.external)
    for (int j = 0; j < model.n_joints(); ++j)
      if (model.joints[j].last_of_body)
        columns_.state(model.joints[j].body).bias -= user_wrench(in.external, model.joints[j], j);
  for_branches(schedule_.inward, [&](const std::vector<int>& branch) {
    for (size_t i = branch.size(); i-- > 0;) {
      gather(branch[i]);
      failed_[branch[i]] = !eliminate(branch[i], in.tau);
    }
  });
  DynamicsReport report;
  if (const auto at = std::find(failed_.begin(), failed_.end(), char{1}); at != failed_.end()) {
    report.outcome = Outcome::not_positive_definite;
    report.body = static_cast<int>(at - failed_.begin());
    return report;
  }
  for_branches(schedule_.outward, [&](const std::vector<int>& branch) {
    for (int n : branch) accelerate(n, in, du);
  });
  if (loads)
    store_joint_loads(
        model, in.q, [&](int n) -> const Force<double>& { return load_[n]; }, loads);
  return report;
}

}  // namespace linkwise
