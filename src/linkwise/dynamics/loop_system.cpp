#include "linkwise/dynamics/loop_system.hpp"

#include <algorithm>

#include "linkwise/linear/pivoted_qr.hpp"
#include "linkwise/simd/cholesky.hpp"

namespace linkwise {
namespace {

/// Rows that share a body are coupled.
Profile profile_of(const LoopGroup& group) {
  std::vector<int> first(group.rows);
  for (const auto& member : group.members)
    std::fill_n(first.begin() + member.row, member.n_rows, member.row);
  for (const auto& carrier : group.carriers)
    for (const int row : carrier.rows) first[row] = std::min(first[row], carrier.rows.front());
  return Profile(std::move(first));
}

/// x <- L^-1 x, x of stride.
void forward(const double* L, int n, double* x, int stride) {
  for (int i = 0; i < n; ++i) {
    for (int l = 0; l < i; ++l) x[i * stride] -= L[packed(i, l)] * x[l * stride];
    x[i * stride] *= L[packed(i, i)];
  }
}

}  // namespace

LoopSystem::LoopSystem(const LoopGroup& group) : profile_(profile_of(group)) {
  for (const auto& member : group.members) blocks_.push_back({member.row, member.n_rows});
  metric_.resize(blocks_.size());
  Lambda_.resize(profile_.n_entries());
}

int LoopSystem::width() const {
  int width = 0;
  for (int i = 0; i < profile_.size(); ++i) width = std::max(width, i - profile_.first(i));
  return width;
}

void LoopSystem::clear() { std::fill(Lambda_.begin(), Lambda_.end(), 0.0); }

/// L^-1 Lambda L^-T with D = L L^T, block by block of the lower triangle.
void LoopSystem::scale_matrix() {
  scaled_ = Lambda_;
  double block[36];
  for (size_t a = 0; a < blocks_.size(); ++a) {
    const auto [row, n] = blocks_[a];
    for (size_t b = a + 1; b-- > 0 && blocks_[b].row >= profile_.first(row);) {
      const auto [column, m] = blocks_[b];
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < m; ++j) {
          const bool upper = a == b && j > i;
          block[6 * i + j] =
              profile_.row(scaled_.data(), row + (upper ? j : i))[column + (upper ? i : j)];
        }
      for (int j = 0; j < m; ++j) forward(metric_[a].data(), n, block + j, 6);
      for (int i = 0; i < n; ++i) forward(metric_[b].data(), m, block + 6 * i, 1);
      for (int i = 0; i < n; ++i)
        std::copy_n(block + 6 * i, a == b ? i + 1 : m,
                    profile_.row(scaled_.data(), row + i) + column);
    }
  }
}

void LoopSystem::factor(double null, bool least) {
  for (size_t m = 0; m < blocks_.size(); ++m) cholesky_factor(blocks_[m].n, metric_[m].data(), 0.0);
  scale_matrix();
  if (is_small()) return factor_exactly(null);
  banded_.factor(profile_, blocks_, scaled_, null);
  least_ = least && banded_.rank() < profile_.size();
  if (least_) shifted_.factor(profile_, scaled_);
}

void LoopSystem::factor_exactly(double null) {
  const int n = profile_.size();
  dense_.assign(static_cast<size_t>(n) * n, 0.0);
  for (int i = 0; i < n; ++i) {
    const double* own = profile_.row(scaled_.data(), i);
    std::copy(own + profile_.first(i), own + i + 1,
              &dense_[static_cast<size_t>(i) * n + profile_.first(i)]);
  }
  exact_.factor(n, dense_.data(), null);
}

std::vector<char> LoopSystem::independent() const {
  std::vector<char> taken(profile_.size(), 0);
  for (int k = 0; k < profile_.size(); ++k)
    if (const int row = is_small() ? exact_.taken(k) : banded_.taken(k); row >= 0) taken[row] = 1;
  return taken;
}

double LoopSystem::solve(std::vector<double>& x) {
  to_scaled(x.data());
  const double missed = is_small() ? exact_.solve(x.data(), x.data()) : solve_large(x.data());
  from_scaled(x.data());
  return missed;
}

/// What the shift leaves undone of the least f is done without it.
double LoopSystem::solve_large(double* x) {
  if (!least_) return banded_.solve(profile_, scaled_, x, x);
  const auto n = static_cast<size_t>(profile_.size());
  rest_.assign(x, x + n);
  product_.resize(n);
  shifted_.solve(profile_, scaled_, x, x);
  multiply(profile_, scaled_.data(), x, product_.data());
  for (size_t i = 0; i < n; ++i) rest_[i] -= product_[i];
  const double missed = banded_.solve(profile_, scaled_, rest_.data(), rest_.data());
  for (size_t i = 0; i < n; ++i) x[i] += rest_[i];
  return missed;
}

void LoopSystem::null_vector(int k, std::vector<double>& f) const {
  f.resize(profile_.size());
  exact_.null_vector(k, f.data());
  from_scaled(f.data());
}

int LoopSystem::null_basis(double null, std::vector<double>& f) {
  if (!is_small()) factor_exactly(null);
  const int n = n_null();
  const auto rows = static_cast<size_t>(profile_.size());
  f.resize(n * rows);
  for (int k = 0; k < n; ++k) exact_.null_vector(k, &f[k * rows]);
  orthonormalise(profile_.size(), f);
  for (int k = 0; k < n; ++k) from_scaled(&f[k * rows]);
  return n;
}

void LoopSystem::to_scaled(double* x) const {
  for (size_t m = 0; m < blocks_.size(); ++m)
    forward(metric_[m].data(), blocks_[m].n, x + blocks_[m].row, 1);
}

/// x <- L^-T x: forces from those where D is 1.
void LoopSystem::from_scaled(double* x) const {
  for (size_t m = 0; m < blocks_.size(); ++m) {
    const double* L = metric_[m].data();
    double* const own = x + blocks_[m].row;
    for (int i = blocks_[m].n - 1; i >= 0; --i) {
      for (int l = i + 1; l < blocks_[m].n; ++l) own[i] -= L[packed(l, i)] * own[l];
      own[i] *= L[packed(i, i)];
    }
  }
}

}  // namespace linkwise
