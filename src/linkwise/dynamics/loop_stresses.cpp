// Self-stresses of closed loops, and bearings that share among them: ArticulatedLoops.
#include <algorithm>
#include <cmath>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/kinematics/coupling_states.hpp"

namespace linkwise {
namespace {

/// Of the largest force of a self-stress: what is less is rounding.
constexpr double touched = 1e-8;
/// Of a group with bearings: a dense factor of more takes seconds a state.
constexpr int most_rows = 1000;

}  // namespace

void ArticulatedLoops::self_stress(int g, int k, const double* q, double* loads) const {
  std::vector<double> f;
  systems_[g].null_vector(k, f);
  store_stress(g, f.data(), q, loads);
}

/// Joint loads of forces of a group that move nothing.
void ArticulatedLoops::store_stress(int g, const double* f, const double* q, double* loads) const {
  const Work& w = work_[g];
  std::vector<Force<double>> of_body(model_.n_bodies()), of_loop(model_.n_loops());
  for (const auto& carrier : groups_[g].carriers)
    for (size_t i = 0; i < carrier.rows.size(); ++i) {
      const Force<double>& F = w.columns[carrier.first + i].F;
      const double x = f[carrier.rows[i]];
      of_body[carrier.body] -= x * F;
    }
  store_joint_loads(
      model_, q, [&](int n) { return of_body[n]; }, loads);
  add_to_load(g, f, of_loop);
  for (int l = 0; l < model_.n_loops(); ++l)
    store_loop_load(model_.loops.joints[l], of_loop[l], loads + 6 * (model_.n_joints() + l));
  // Couplings that repeat each other cancel in every joint, and leave rounding alone.
  double acting = 0, left = 0;
  for (const auto& member : groups_[g].members) acting = std::max(acting, size_of(member, f, q));
  const double length = longest_loop();
  const size_t n = 6 * static_cast<size_t>(model_.n_loads());
  for (size_t i = 0; i < n; ++i)
    left = std::max(left, std::abs(loads[i]) / (i % 6 < 3 ? 1 : length));
  if (left < touched * acting) std::fill_n(loads, n, 0.0);
}

/// The largest force, or moment over the loops' length, that a member puts into a joint.
double ArticulatedLoops::size_of(const LoopGroup::Member& member, const double* f,
                                 const double* q) const {
  const double length = longest_loop();
  double largest = 0;
  for (int i = 0; member.loop >= 0 && i < member.n_rows; ++i) {
    const Vector6<double>& Q = states_[member.loop].row[i];
    for (int k = 0; k < 6; ++k)
      largest = std::max(largest, std::abs(f[member.row + i] * Q[k]) / (k < 3 ? 1 : length));
  }
  if (member.coupling < 0) return largest;
  const CoupledState at{q, nullptr, states_.q().data(), nullptr};
  for (const Coupling::Term& term : model_.couplings[member.coupling].terms) {
    const JointType type = model_.joint_at(term.joint).type;
    const double per = type == JointType::prismatic ? 1 : length;
    largest = std::max(largest, std::abs(f[member.row] * term.slope(at.position(term))) / per);
  }
  return largest;
}

/// Marks the couplings of a group that forces f which cancel act in.
void ArticulatedLoops::mark_couplings(int g, const double* f, const double* q,
                                      std::vector<char>& marks) const {
  double acting = 0;
  for (const auto& member : groups_[g].members) acting = std::max(acting, size_of(member, f, q));
  for (const auto& member : groups_[g].members)
    if (member.coupling >= 0 && size_of(member, f, q) > touched * acting)
      marks[member.coupling] = 1;
}

/// Of each group its bearings. InputError where a group is too large for its null vectors.
void ArticulatedLoops::make_bearing_shares() {
  for (const LoopGroup& group : groups_) {
    std::vector<int> own;
    for (int b = 0; b < static_cast<int>(model_.bearings.size()); ++b) {
      const int load = model_.bearings[b].load, l = load - model_.n_joints();
      const bool inside =
          l >= 0 ? std::any_of(group.members.begin(), group.members.end(),
                               [&](const auto& member) { return member.loop == l; })
                 : std::any_of(group.carriers.begin(), group.carriers.end(),
                               [&](const auto& at) { return at.body == model_.joints[load].body; });
      if (inside) own.push_back(b);
    }
    if (!own.empty() && group.rows > most_rows)
      throw InputError("model '" + model_.spec().name + "'" + model_.where() +
                       ": bearing of joint '" + model_.joint_at(model_.bearings[own[0]].load).name +
                       "' is in loops that hold " + std::to_string(group.rows) +
                       " directions together, and bearings take up to " +
                       std::to_string(most_rows) + "; remove the bearings");
    shares_.emplace_back(model_, std::move(own));
  }
}

double ArticulatedLoops::longest_loop() const {
  double length = model_.n_loops() > 0 ? 0 : 1;
  for (int l = 0; l < model_.n_loops(); ++l) length = std::max(length, states_[l].length);
  return length;
}

/// Self-stresses of a group, for its bearings. Returns how many there are.
int ArticulatedLoops::find_stresses(int g, const double* q) {
  const int n = systems_[g].null_basis(null_, null_forces_);
  const size_t width = 6 * static_cast<size_t>(model_.n_loads());
  stresses_.resize(n * width);
  for (int k = 0; k < n; ++k)
    store_stress(g, &null_forces_[static_cast<size_t>(k) * groups_[g].rows], q,
                 &stresses_[k * width]);
  if (n > 0) shares_[g].factor(n, stresses_.data(), longest_loop());
  return n;
}

void ArticulatedLoops::share_by_bearings(int g, const double* q, double misfit, double* loads) {
  if (shares_[g].empty()) return;
  const int n = find_stresses(g, q);
  if (n == 0) return;
  alpha_.resize(n);
  shares_[g].place_misfits(q, states_);
  shares_[g].solve(loads, stresses_.data(), misfit, alpha_.data());
  const size_t width = 6 * static_cast<size_t>(model_.n_loads()), rows = groups_[g].rows;
  for (int k = 0; k < n; ++k) {
    for (size_t i = 0; i < width; ++i) loads[i] -= alpha_[k] * stresses_[k * width + i];
    for (size_t i = 0; i < rows; ++i) work_[g].f[i] -= alpha_[k] * null_forces_[k * rows + i];
  }
}

void ArticulatedLoops::append_undecided(int g, const double* q, std::vector<double>& loads,
                                        std::vector<char>& couplings) {
  std::vector<double> f;
  if (shares_.empty() || shares_[g].empty()) {
    const int n = find_self_stresses(g);
    const size_t width = 6 * static_cast<size_t>(model_.n_loads());
    for (int k = 0; k < n; ++k) {
      loads.resize(loads.size() + width);
      self_stress(g, k, q, loads.data() + loads.size() - width);
      systems_[g].null_vector(k, f);
      mark_couplings(g, f.data(), q, couplings);
    }
    return;
  }
  const int n = find_stresses(g, q);
  if (n == 0) return;
  const std::vector<double> sums = shares_[g].undecided();
  const size_t width = 6 * static_cast<size_t>(model_.n_loads());
  for (size_t s = 0; s < sums.size() / n; ++s) {
    loads.resize(loads.size() + width);
    double* const out = loads.data() + loads.size() - width;
    for (int k = 0; k < n; ++k)
      for (size_t i = 0; i < width; ++i) out[i] += sums[s * n + k] * stresses_[k * width + i];
    const size_t rows = groups_[g].rows;
    f.assign(rows, 0.0);
    for (int k = 0; k < n; ++k)
      for (size_t i = 0; i < rows; ++i) f[i] += sums[s * n + k] * null_forces_[k * rows + i];
    mark_couplings(g, f.data(), q, couplings);
  }
}

}  // namespace linkwise
