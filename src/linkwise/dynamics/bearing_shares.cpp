#include "linkwise/dynamics/bearing_shares.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace

BearingShares::BearingShares(const Model& model, std::vector<int> bearings)
    : model_(model), bearings_(std::move(bearings)) {}

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
  fill(root);
  const auto r = static_cast<size_t>(structure_.rank());
  turned_.assign(m * r, 0.0);
  for (size_t i = 0; i < m; ++i)
    for (size_t c = 0; c < r; ++c)
      for (int k = 0; k < n; ++k) turned_[i * r + c] += rows_[i * n + k] * decided_[c * n + k];
  weighted_.factor(static_cast<int>(m), static_cast<int>(r), turned_.data(), 0);
}

void BearingShares::solve(const double* w, double* alpha) {
  b_.resize(6 * bearings_.size());
  for (size_t b = 0; b < bearings_.size(); ++b)
    weigh(model_.bearings[bearings_[b]], w, root, &b_[6 * b], 1);
  const auto r = static_cast<size_t>(structure_.rank());
  x_.resize(r);
  weighted_.solve(b_.data(), x_.data());
  std::fill_n(alpha, n_, 0.0);
  for (size_t c = 0; c < r; ++c)
    for (int k = 0; k < n_; ++k) alpha[k] += x_[c] * decided_[c * n_ + k];
}

}  // namespace linkwise
