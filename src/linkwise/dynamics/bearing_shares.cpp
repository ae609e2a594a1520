#include "linkwise/dynamics/bearing_shares.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace linkwise {
namespace {

/// Of the largest component of a self-stress: what is less is rounding.
constexpr double touched = 1e-8;

/// By `across` what lies across the axis, by `along` what lies along it.
Vec3<double> weighted(const Vec3<double>& axis, double across, double along,
                      const Vec3<double>& x) {
  return across * x + ((along - across) * dot(axis, x)) * axis;
}

/// The load of a bearing, [n_loads][6], times weights of its directions: to out [6 stride].
template <class F>
void weigh(const Bearing& bearing, const double* loads, F&& weight, double* out, size_t stride) {
  const double* const w = loads + 6 * bearing.load;
  const Vec3<double> force =
      weighted(bearing.axis, weight(bearing.across), weight(bearing.along), {w[0], w[1], w[2]});
  const Vec3<double> moment =
      weighted(bearing.axis, weight(bearing.tilting), weight(bearing.turning), {w[3], w[4], w[5]});
  const double all[6] = {force.x, force.y, force.z, moment.x, moment.y, moment.z};
  for (int i = 0; i < 6; ++i) out[i * stride] = all[i];
}

double root(double yields) { return std::sqrt(yields); }

/// Axes of the body before a joint -> the user's axes of the joint, at coordinates of the tree, or
/// of loop joints where it closes one.
Mat3<double> axes_at(const Model& model, int load, const double* q, const double* loop_q) {
  const bool closes = load >= model.n_joints();
  const JointInfo& joint = model.joint_at(load);
  const Element* const first =
      (closes ? model.loops.elements : model.elements).data() + joint.first_element;
  Mat3<double> R = Mat3<double>::identity();
  for (int e = 0; e < joint.n_elements; ++e) R = element_pose(first[e], closes ? loop_q : q).R * R;
  return joint.to_user.R * R;
}

/// Of each load: its joint's axes as drawn -> parent's.
std::vector<Mat3<double>> axes_as_drawn(const Model& model) {
  const std::vector<double> q = model.neutral_configuration();
  std::vector<double> loop_q(model.loops.nq);
  for (const Element& e : model.loops.elements)
    if (const int own = info_of(e.kind).quaternion; own >= 0) loop_q[e.q + own + 3] = 1;
  std::vector<Mat3<double>> out;
  for (int load = 0; load < model.n_loads(); ++load)
    out.push_back(transpose(axes_at(model, load, q.data(), loop_q.data())));
  return out;
}

/// Along a rod from its parent's point to its child's, in the axes of its load; null for other
/// joints.
std::optional<Vec3<double>> along_rod(const Model& model, int load, const LoopStates& loops) {
  const int l = load - model.n_joints();
  if (l < 0 || model.loops.joints[l].kind != LoopKind::rod) return std::nullopt;
  const Vector6<double>& n = loops[l].row[0];
  return model.loops.joints[l].joint.to_user.R * Vec3<double>{n[0], n[1], n[2]};
}

}  // namespace

BearingShares::BearingShares(const Model& model, std::vector<int> bearings)
    : model_(model), bearings_(std::move(bearings)), misfit_(bearings_.size()) {
  const std::vector<Mat3<double>> unturned = axes_as_drawn(model);
  for (const int b : bearings_) {
    has_misfits_ |= model.bearings[b].has_misfit;
    unturned_.push_back(unturned[model.bearings[b].load]);
  }
}

std::vector<Vec3<double>> preload_forces(const Model& model, const double* q,
                                         const LoopStates& loops) {
  const std::vector<Mat3<double>> unturned = axes_as_drawn(model);
  std::vector<Vec3<double>> out(model.n_loads());
  for (const Bearing& bearing : model.bearings) {
    const int load = bearing.load;
    if (const auto along = along_rod(model, load, loops))
      out[load] = bearing.preload.z * *along;
    else
      out[load] = axes_at(model, load, q, loops.q().data()) * unturned[load] * bearing.preload;
  }
  return out;
}

void BearingShares::place_misfits(const double* q, const LoopStates& loops) {
  for (size_t b = 0; has_misfits_ && b < bearings_.size(); ++b) {
    const Bearing& bearing = model_.bearings[bearings_[b]];
    Mat3<double> R = axes_at(model_, bearing.load, q, loops.q().data()) * unturned_[b];
    Vec3<double> offset = R * bearing.offset, turn = R * bearing.turn,
                 preload = R * bearing.preload;
    if (const auto along = along_rod(model_, bearing.load, loops)) {
      offset = bearing.offset.z * *along;
      preload = bearing.preload.z * *along;
    }
    offset += weighted(bearing.axis, bearing.across, bearing.along, preload);
    misfit_[b] = {offset.x, offset.y, offset.z, turn.x, turn.y, turn.z};
    leave_out_rigid(b, misfit_[b]);
  }
}

void BearingShares::factor(int n, const double* S, double length) {
  n_ = n;
  const auto m = 6 * bearings_.size();
  const size_t width = 6 * static_cast<size_t>(model_.n_loads());
  double largest = 0;
  for (size_t i = 0; i < n * width; ++i)
    largest = std::max(largest, std::abs(S[i]) / (i % 6 < 3 ? 1 : length));
  rows_.resize(m * n);
  const auto fill = [&](auto&& weight) {
    for (size_t b = 0; b < bearings_.size(); ++b)
      for (int k = 0; k < n; ++k)
        weigh(model_.bearings[bearings_[b]], S + k * width, weight, &rows_[6 * b * n + k], n);
  };
  // What is decided depends on which directions yield, not on how much they do.
  fill([](double yields) { return yields > 0 ? 1.0 : 0.0; });
  for (size_t i = 0; i < m; ++i)
    for (int k = 0; i % 6 >= 3 && k < n; ++k) rows_[i * n + k] /= length;
  structure_.factor(static_cast<int>(m), n, rows_.data(), touched * largest);
  decided_ = structure_.seen();
  if (has_misfits_) {
    length_ = length;
    find_rigid(S, largest);
  }
  fill(root);
  const auto r = static_cast<size_t>(structure_.rank());
  turned_.assign(m * r, 0.0);
  for (size_t i = 0; i < m; ++i)
    for (size_t c = 0; c < r; ++c)
      for (int k = 0; k < n; ++k) turned_[i * r + c] += rows_[i * n + k] * decided_[c * n + k];
  weighted_.factor(static_cast<int>(m), static_cast<int>(r), turned_.data(), 0);
}

/// Moments count by a length, so that turns do by its inverse.
void BearingShares::find_rigid(const double* S, double largest) {
  const std::vector<double> sums = structure_.unseen();
  const size_t width = 6 * static_cast<size_t>(model_.n_loads());
  rigid_.assign(bearings_.size(), {});
  for (size_t b = 0; b < bearings_.size(); ++b)
    for (size_t s = 0; n_ > 0 && s < sums.size() / n_; ++s) {
      double load[6] = {};
      for (int k = 0; k < n_; ++k)
        for (int i = 0; i < 6; ++i)
          load[i] += sums[s * n_ + k] * S[k * width + 6 * model_.bearings[bearings_[b]].load + i] /
                     (i < 3 ? 1 : length_);
      std::vector<double>& own = rigid_[b];
      for (int pass = 0; pass < 2; ++pass)
        for (size_t r = 0; r < own.size() / 6; ++r) {
          double part = 0;
          for (int i = 0; i < 6; ++i) part += own[6 * r + i] * load[i];
          for (int i = 0; i < 6; ++i) load[i] -= part * own[6 * r + i];
        }
      double size = 0;
      for (const double x : load) size += x * x;
      size = std::sqrt(size);
      if (!(size > touched * largest)) continue;
      for (const double x : load) own.push_back(x / size);
    }
}

void BearingShares::leave_out_rigid(size_t b, Vector6<double>& misfit) const {
  const std::vector<double>& own = rigid_[b];
  for (size_t r = 0; r < own.size() / 6; ++r) {
    double part = 0;
    for (int i = 0; i < 6; ++i) part += own[6 * r + i] * misfit[i] * (i < 3 ? 1 : length_);
    for (int i = 0; i < 6; ++i) misfit[i] -= part * own[6 * r + i] / (i < 3 ? 1 : length_);
  }
}

void BearingShares::solve(const double* w, const double* S, double misfit, double* alpha) {
  b_.resize(6 * bearings_.size());
  for (size_t b = 0; b < bearings_.size(); ++b)
    weigh(model_.bearings[bearings_[b]], w, root, &b_[6 * b], 1);
  const auto r = static_cast<size_t>(structure_.rank());
  x_.resize(r);
  weighted_.solve(b_.data(), x_.data());
  if (has_misfits_ && misfit != 0) {
    const size_t width = 6 * static_cast<size_t>(model_.n_loads());
    gap_.assign(r, 0.0);
    for (int k = 0; k < n_; ++k) {
      double open = 0;
      for (size_t b = 0; b < bearings_.size(); ++b)
        for (int i = 0; i < 6; ++i)
          open += S[k * width + 6 * model_.bearings[bearings_[b]].load + i] * misfit_[b][i];
      for (size_t c = 0; c < r; ++c) gap_[c] += misfit * open * decided_[c * n_ + k];
    }
    turned_gap_.resize(r);
    weighted_.solve_normal(gap_.data(), turned_gap_.data());
    for (size_t c = 0; c < r; ++c) x_[c] -= turned_gap_[c];
  }
  std::fill_n(alpha, n_, 0.0);
  for (size_t c = 0; c < r; ++c)
    for (int k = 0; k < n_; ++k) alpha[k] += x_[c] * decided_[c * n_ + k];
}

}  // namespace linkwise
