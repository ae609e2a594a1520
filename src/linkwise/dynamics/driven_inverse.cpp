#include "linkwise/dynamics/driven_inverse.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/loop_groups.hpp"
#include "linkwise/forces/armature_bias.hpp"

namespace linkwise {
namespace {

/// Accelerations that differ by less than this part, by the roots of their energies, are the same.
constexpr double same = 1e-6;
/// Part of what a degree of freedom of the open tree yields to its torque, below which the others
/// hold it. At a distance d from a dead centre it is d^2.
constexpr double held = 1e-10;

std::string number(double x) {
  std::ostringstream text;
  text.precision(6);
  text << x;
  return text.str();
}

}  // namespace

DrivenInverse::DrivenInverse(const Model& model, std::span<const std::string> driven)
    : model_(model), tree_(model), mobility_(model) {
  for (const LoopJoint& loop : model.loops.joints)
    if (loop_rotors(model, loop) > 0)
      throw InputError("joint '" + loop.joint.name + "'" + model.where() +
                       " closes a loop and has an armature, which inverse dynamics does not take; "
                       "let another joint close the loop");
  for (const std::string& name : driven) {
    for (const LoopJoint& loop : model.loops.joints)
      if (loop.joint.name == name)
        throw InputError("driven: joint '" + name + "'" + model.where() +
                         " closes a loop; drive joints of the tree, or close the loop elsewhere");
    const JointInfo& joint = model.joints[model.joint_index(name)];
    if (joint.nv == 0)
      throw InputError("driven: joint '" + name + "' has no freedom; leave it out");
    for (int i = joint.v; i < joint.v + joint.nv; ++i) {
      if (std::find(dofs_.begin(), dofs_.end(), i) != dofs_.end())
        throw InputError("driven: joint '" + name + "' is given twice; give it once");
      dofs_.push_back(i);
    }
  }
  if (dofs_.empty()) {
    std::string names;
    for (const JointInfo& joint : model.joints)
      if (joint.nv > 0) names += (names.empty() ? "'" : ", '") + joint.name + "'";
    throw InputError(
        "model '" + model.spec().name + "'" + model.where() +
        " has closed loops or couplings, so torques of a motion depend on which joints "
        "drive it; give driven=[...] with as many degrees of freedom as the machine "
        "can move in, of " +
        names);
  }
  if (!model.spec().prescribed.empty())
    throw InputError("model '" + model.spec().name + "'" + model.where() + ": joint '" +
                     model.spec().prescribed.front() +
                     "' is prescribed; give the model before prescribe([...])");
  DynamicsOptions options;
  options.method = "articulated_body";
  method_ = make_dynamics(model, options);
  B_.resize(dofs_.size() * dofs_.size());
  for (auto* x : {&rest_, &beside_, &tau_, &a0_, &du_, &miss_, &work_}) x->assign(model.nv(), 0.0);
}

DynamicsReport DrivenInverse::forward(const SweepInput<double>& in, double* du, double* loads) {
  return method_->evaluate(0, in, du, loads);
}

/// a^T H a of the tree.
double DrivenInverse::energy(const SweepInput<double>& in, const double* a) {
  SweepInput<double> still;
  still.q = in.q;
  still.v = rest_.data();
  still.gravity_factor = 0;
  tree_.evaluate(still, a, work_.data(), nullptr);
  double sum = 0;
  for (int i = 0; i < model_.nv(); ++i) sum += a[i] * work_[i];
  return std::max(sum, 0.0);
}

/// The degree of freedom that differs most, in words.
std::string DrivenInverse::largest(const double* got, const double* asked) const {
  int at = 0;
  for (int i = 1; i < model_.nv(); ++i)
    if (std::abs(got[i] - asked[i]) > std::abs(got[at] - asked[at])) at = i;
  return "joint '" + name_of(at) + "' by " + number(got[at]) + ", not " + number(asked[at]);
}

std::string DrivenInverse::name_of(int dof) const {
  for (const JointInfo& joint : model_.joints)
    if (dof >= joint.v && dof < joint.v + joint.nv) return joint.name;
  return "";
}

/// Torques of the open tree make the accelerations without any force of a loop, if and only if they
/// keep the loops closed. Otherwise the loops turn them into the nearest ones that do.
DynamicsReport DrivenInverse::require_closed(const SweepInput<double>& in, const double* a,
                                             double size, const std::string& where) {
  SweepInput<double> open = in;
  open.loop_tau = nullptr;
  tree_.evaluate(open, a, tau_.data(), nullptr);
  add_armature_bias(model_, in.v, 1, tau_.data());
  open.tau = tau_.data();
  const DynamicsReport report = forward(open, du_.data());
  if (!report.ok()) return report;
  for (int i = 0; i < model_.nv(); ++i) miss_[i] = du_[i] - a[i];
  if (std::sqrt(energy(in, miss_.data())) > same * size)
    throw InputError(where +
                     "accelerations open the loops; the nearest that keep them closed move " +
                     largest(du_.data(), a));
  return report;
}

/// B_d column by column, as the answer to a torque alone, and its factor.
DynamicsReport DrivenInverse::factor(const SweepInput<double>& in, const std::string& where) {
  const int n = static_cast<int>(dofs_.size());
  SweepInput<double> still = in;
  still.v = rest_.data();
  still.external = still.loop_tau = nullptr;
  still.gravity_factor = 0;
  std::fill(tau_.begin(), tau_.end(), 0.0);
  still.tau = tau_.data();
  for (int j = 0; j < n; ++j) {
    tau_[dofs_[j]] = 1;
    const DynamicsReport report = forward(still, du_.data());
    if (!report.ok()) return report;
    tau_[dofs_[j]] = 0;
    for (int i = 0; i < n; ++i) B_[i * n + j] = du_[dofs_[i]];
  }
  const std::span<const double> alone = mobility_.evaluate(in.q);
  for (int j = 0; j < n; ++j) {
    double* const row = B_.data() + j * n;
    for (int i = 0; i < j; ++i) {
      double sum = row[i];
      for (int k = 0; k < i; ++k) sum -= row[k] * B_[i * n + k];
      row[i] = sum / B_[i * n + i];
    }
    double pivot = row[j];
    for (int k = 0; k < j; ++k) pivot -= row[k] * row[k];
    if (alone.empty() || !(pivot > held * alone[dofs_[j]]))
      throw InputError(where + "driven: joint '" + name_of(dofs_[j]) +
                       "' cannot move by itself here once the driven joints before it are held, so "
                       "its torque is not determined; leave it out, or drive another joint");
    row[j] = std::sqrt(pivot);
  }
  return {};
}

void DrivenInverse::solve(double* x) const {
  const int n = static_cast<int>(dofs_.size());
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= B_[i * n + k] * x[k];
    x[i] /= B_[i * n + i];
  }
  for (int i = n; i-- > 0;) {
    for (int k = i + 1; k < n; ++k) x[i] -= B_[k * n + i] * x[k];
    x[i] /= B_[i * n + i];
  }
}

DynamicsReport DrivenInverse::evaluate(SweepInput<double> in, const double* a,
                                       const std::string& where, double* tau, double* loads) {
  const size_t n = dofs_.size();
  std::copy_n(in.tau, model_.nv(), beside_.begin());
  DynamicsReport report = forward(in, a0_.data());
  if (!report.ok()) return report;
  const double size = std::sqrt(energy(in, a)) + std::sqrt(energy(in, a0_.data()));
  if (report = require_closed(in, a, size, where); !report.ok()) return report;
  if (report = factor(in, where); !report.ok()) return report;
  std::vector<double> total = beside_, drives(model_.nv()), x(n);
  in.tau = total.data();
  // The second time with what rounding left.
  for (int step = 0; step < 2; ++step) {
    const double* const so_far = step == 0 ? a0_.data() : du_.data();
    for (size_t i = 0; i < n; ++i) x[i] = a[dofs_[i]] - so_far[dofs_[i]];
    solve(x.data());
    for (size_t i = 0; i < n; ++i) {
      drives[dofs_[i]] += x[i];
      total[dofs_[i]] = beside_[dofs_[i]] + drives[dofs_[i]];
    }
    if (report = forward(in, du_.data(), loads); !report.ok()) return report;
  }
  for (int i = 0; i < model_.nv(); ++i) miss_[i] = du_[i] - a[i];
  if (std::sqrt(energy(in, miss_.data())) > same * size)
    throw InputError(where + "driven: these joints do not make this motion; with them " +
                     largest(du_.data(), a) + "; drive more or other joints");
  if (tau) std::copy(drives.begin(), drives.end(), tau);
  return report;
}

}  // namespace linkwise
