#include "linkwise/dynamics/driven_inverse.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "linkwise/base/error.hpp"

namespace linkwise {
namespace {

/// Accelerations that differ by less than this part, by the roots of their energies, are the same.
constexpr double same = 1e-6;
/// Of what the open tree would do.
constexpr double rounding = 1e-12;
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
    : model_(model), tree_(model), open_(model), loops_(model) {
  for (const std::string& name : driven) add_driven(name);
  if (dofs_.empty()) {
    std::string names;
    for (const JointInfo& joint : model.joints)
      if (joint.nv > 0 && joint.type != JointType::elastic)
        names += (names.empty() ? "'" : ", '") + joint.name + "'";
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
  answer_.resize(dofs_.size() * model.nv());
  for (auto* x : {&rest_, &beside_, &tau_, &a0_, &du_, &miss_, &work_}) x->assign(model.nv(), 0.0);
  for (auto* x : {&loop_rest_, &loop_beside_, &loop_tau_}) x->assign(model.loops.nv, 0.0);
}

void DrivenInverse::add_driven(const std::string& name) {
  const int load = model_.load_index(name);
  const JointInfo& joint = model_.joint_at(load);
  const bool closes = load >= model_.n_joints();
  if (joint.type == JointType::elastic)
    throw InputError("driven: joint '" + name +
                     "' is elastic, and its coordinates have no drive; drive another joint");
  if (joint.nv == 0) throw InputError("driven: joint '" + name + "' has no freedom; leave it out");
  for (int i = joint.v; i < joint.v + joint.nv; ++i) {
    if (std::find(dofs_.begin(), dofs_.end(), Dof{i, closes}) != dofs_.end())
      throw InputError("driven: joint '" + name + "' is given twice; give it once");
    dofs_.push_back({i, closes});
  }
}

DynamicsReport DrivenInverse::forward(const SweepInput<double>& in, double* du, double* loads) {
  return method_->evaluate(0, in, du, loads);
}

/// a^T H a of the tree and of rotors on loop joints.
double DrivenInverse::energy(const double* q, const double* a) {
  SweepInput<double> still;
  still.q = q;
  still.v = rest_.data();
  still.gravity_factor = 0;
  tree_.evaluate(still, a, work_.data(), nullptr);
  loops_.add_rotors(q, a, work_.data());
  double sum = 0;
  for (int i = 0; i < model_.nv(); ++i) sum += a[i] * work_[i];
  return std::max(sum, 0.0);
}

/// The degree of freedom that differs most, in words.
std::string DrivenInverse::largest(const double* got, const double* asked) const {
  int at = 0;
  for (int i = 1; i < model_.nv(); ++i)
    if (std::abs(got[i] - asked[i]) > std::abs(got[at] - asked[at])) at = i;
  return "joint '" + name_of({at, false}) + "' by " + number(got[at]) + ", not " +
         number(asked[at]);
}

std::string DrivenInverse::name_of(const Dof& dof) const {
  for (int j = dof.closes ? model_.n_joints() : 0; j < model_.n_loads(); ++j) {
    const JointInfo& joint = model_.joint_at(j);
    if (dof.index >= joint.v && dof.index < joint.v + joint.nv) return joint.name;
  }
  return "";
}

/// By how much, as the root of its energy, accelerations may differ that count as the same. Where
/// loops balance what acts, a and a_0 are the rounding of what the open tree would do.
double DrivenInverse::calc_allowed(const SweepInput<double>& in, const double* a) {
  const double closed = std::sqrt(energy(in.q, a)) + std::sqrt(energy(in.q, a0_.data()));
  if (!open_.evaluate(in, du_.data(), nullptr)) return same * closed;
  return same * closed + rounding * std::sqrt(energy(in.q, du_.data()));
}

/// Torques H (a - a_0) of the open tree beside those that make a_0 give a, if and only if a keeps
/// the loops closed: then no force of a loop has to change. Otherwise the loops turn them into the
/// nearest accelerations that do.
DynamicsReport DrivenInverse::require_closed(const SweepInput<double>& in, const double* a,
                                             double allowed, const std::string& where) {
  for (int i = 0; i < model_.nv(); ++i) miss_[i] = a[i] - a0_[i];
  SweepInput<double> still;
  still.q = in.q;
  still.gravity_factor = 0;
  tree_.evaluate(still, miss_.data(), tau_.data(), nullptr);
  loops_.add_rotors(in.q, miss_.data(), tau_.data());
  for (int i = 0; i < model_.nv(); ++i) tau_[i] += beside_[i];
  SweepInput<double> with = in;
  with.tau = tau_.data();
  const DynamicsReport report = forward(with, du_.data());
  if (!report.ok()) return report;
  for (int i = 0; i < model_.nv(); ++i) miss_[i] = du_[i] - a[i];
  if (std::sqrt(energy(in.q, miss_.data())) > allowed)
    throw InputError(where +
                     "accelerations open the loops; the nearest that keep them closed move " +
                     largest(du_.data(), a));
  return report;
}

/// Of accelerations du, or of a difference of two, those of the driven degrees of freedom.
void DrivenInverse::read_driven(const double* q, const double* du, double* x) {
  const bool closes = std::any_of(dofs_.begin(), dofs_.end(), [](auto& dof) { return dof.closes; });
  const std::span<const double> of_loops = closes ? loops_.rates(q, du) : std::span<const double>{};
  for (size_t i = 0; i < dofs_.size(); ++i)
    x[i] = dofs_[i].closes ? of_loops[dofs_[i].index] : du[dofs_[i].index];
}

/// What a degree of freedom yields to its own torque in the open tree; 0 where that fails.
double DrivenInverse::alone(const double* q, const Dof& dof) {
  std::fill(tau_.begin(), tau_.end(), 0.0);
  if (dof.closes) {
    loops_.rates(q, rest_.data());
    loop_tau_[dof.index] = 1;
    loops_.add_torques(q, loop_tau_.data(), tau_.data());
    loop_tau_[dof.index] = 0;
  } else {
    tau_[dof.index] = 1;
  }
  SweepInput<double> still;
  still.q = q;
  still.v = rest_.data();
  still.tau = tau_.data();
  still.gravity_factor = 0;
  if (!open_.evaluate(still, du_.data(), nullptr)) return 0;
  return dof.closes ? loops_.rates(q, du_.data())[dof.index] : du_[dof.index];
}

/// B_d column by column, as the answer to a torque alone, and its factor.
DynamicsReport DrivenInverse::factor(const double* q, const std::string& where) {
  const int n = n_driven(), nv = model_.nv();
  SweepInput<double> still;
  still.q = q;
  still.v = rest_.data();
  still.gravity_factor = 0;
  still.tau = tau_.data();
  still.loop_tau = loop_tau_.data();
  std::fill(tau_.begin(), tau_.end(), 0.0);
  std::vector<double> column(n);
  DynamicsReport report;
  for (int j = 0; j < n; ++j) {
    double& torque = dofs_[j].closes ? loop_tau_[dofs_[j].index] : tau_[dofs_[j].index];
    torque = 1;
    report = forward(still, &answer_[static_cast<size_t>(j) * nv]);
    torque = 0;
    if (!report.ok()) return report;
    read_driven(q, &answer_[static_cast<size_t>(j) * nv], column.data());
    for (int i = 0; i < n; ++i) B_[i * n + j] = column[i];
  }
  for (int j = 0; j < n; ++j) {
    double* const row = B_.data() + j * n;
    for (int i = 0; i < j; ++i) {
      double sum = row[i];
      for (int k = 0; k < i; ++k) sum -= row[k] * B_[i * n + k];
      row[i] = sum / B_[i * n + i];
    }
    double pivot = row[j];
    for (int k = 0; k < j; ++k) pivot -= row[k] * row[k];
    const double open = alone(q, dofs_[j]);
    if (!(pivot > held * open) || !(open > 0))
      throw InputError(where + "driven: joint '" + name_of(dofs_[j]) +
                       "' cannot move by itself here once the driven joints before it are held, so "
                       "its torque is not determined; leave it out, or drive another joint");
    row[j] = std::sqrt(pivot);
  }
  return report;
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

DynamicsReport DrivenInverse::evaluate(const SweepInput<double>& in, const double* a,
                                       const std::string& where, const Output& out) {
  const size_t n = dofs_.size();
  std::copy_n(in.tau, model_.nv(), beside_.begin());
  std::copy_n(in.loop_tau ? in.loop_tau : loop_rest_.data(), model_.loops.nv, loop_beside_.begin());
  DynamicsReport report = forward(in, a0_.data());
  if (!report.ok()) return report;
  const double allowed = calc_allowed(in, a);
  if (report = require_closed(in, a, allowed, where); !report.ok()) return report;
  if (report = factor(in.q, where); !report.ok()) return report;
  std::vector<double> drives(model_.nv()), loop_drives(model_.loops.nv), x(n);
  std::vector<double> total = beside_, loop_total = loop_beside_;
  SweepInput<double> driven = in;
  driven.tau = total.data();
  driven.loop_tau = loop_total.data();
  // The second time with what rounding left.
  for (int step = 0; step < 2; ++step) {
    const double* const so_far = step == 0 ? a0_.data() : du_.data();
    for (int i = 0; i < model_.nv(); ++i) miss_[i] = a[i] - so_far[i];
    read_driven(in.q, miss_.data(), x.data());
    solve(x.data());
    for (size_t i = 0; i < n; ++i) {
      const int k = dofs_[i].index;
      (dofs_[i].closes ? loop_drives : drives)[k] += x[i];
      if (dofs_[i].closes)
        loop_total[k] = loop_beside_[k] + loop_drives[k];
      else
        total[k] = beside_[k] + drives[k];
    }
    if (report = forward(driven, du_.data(), out.loads); !report.ok()) return report;
  }
  for (int i = 0; i < model_.nv(); ++i) miss_[i] = du_[i] - a[i];
  if (std::sqrt(energy(in.q, miss_.data())) > allowed)
    throw InputError(where + "driven: these joints do not make this motion; with them " +
                     largest(du_.data(), a) + "; drive more or other joints");
  if (out.tau) std::copy(drives.begin(), drives.end(), out.tau);
  if (out.loop_tau) std::copy(loop_drives.begin(), loop_drives.end(), out.loop_tau);
  return report;
}

DynamicsReport DrivenInverse::reduce(const double* q, const std::string& where, double* M,
                                     double* N) {
  const int n = n_driven(), nv = model_.nv();
  const DynamicsReport report = factor(q, where);
  if (!report.ok()) return report;
  if (const int free = nv - report.loops.rank; n < free)
    throw InputError(where + "driven: these joints have " + std::to_string(n) +
                     (n == 1 ? " degree" : " degrees") + " of freedom and the machine moves in " +
                     std::to_string(free) +
                     ", so they do not determine its motion; drive more or other joints");
  std::vector<double> x(n);
  for (int i = 0; N && i < nv; ++i) {
    for (int j = 0; j < n; ++j) x[j] = answer_[static_cast<size_t>(j) * nv + i];
    solve(x.data());
    std::copy(x.begin(), x.end(), N + static_cast<size_t>(i) * n);
  }
  for (int j = 0; M && j < n; ++j) {
    std::fill(x.begin(), x.end(), 0.0);
    x[j] = 1;
    solve(x.data());
    for (int i = j; i < n; ++i) M[i * n + j] = M[j * n + i] = x[i];
  }
  return report;
}

}  // namespace linkwise
