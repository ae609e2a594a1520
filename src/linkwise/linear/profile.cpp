#include "linkwise/linear/profile.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "linkwise/base/assert.hpp"
#include "linkwise/linear/block.hpp"
#include "linkwise/simd/lane_memory.hpp"

namespace linkwise {
namespace {

/// So far above rounding that noise along null vectors stays below 1e-7 of a solution, so far below
/// 1 that weak directions are met within `most_steps`.
constexpr double shift = 1e-9;
constexpr int most_steps = 6;

double largest(const std::vector<double>& x) {
  double size = 0;
  for (const double xi : x) size = std::max(size, std::abs(xi));
  return size;
}

using Wide = Lanes<native_lanes>;

/// In a sum per lane.
double product_of(const double* a, const double* b, int begin, int end) {
  Wide part = {};
  int i = begin;
  for (; i + native_lanes <= end; i += native_lanes)
    part += load_lanes<Wide>(a + i) * load_lanes<Wide>(b + i);
  double sum = 0;
  for (; i < end; ++i) sum += a[i] * b[i];
  for (int k = 0; k < native_lanes; ++k) sum += part[k];
  return sum;
}

/// Of n rows with one other, which is read once.
template <int n>
void products_of(const double* const (&rows)[6], const double* other, int begin, int end,
                 double* sums) {
  Wide part[n] = {};
  int l = begin;
  for (; l + native_lanes <= end; l += native_lanes) {
    const Wide x = load_lanes<Wide>(other + l);
    for (int i = 0; i < n; ++i) part[i] += load_lanes<Wide>(rows[i] + l) * x;
  }
  for (int i = 0; i < n; ++i) {
    sums[i] = 0;
    for (int m = l; m < end; ++m) sums[i] += rows[i][m] * other[m];
    for (int k = 0; k < native_lanes; ++k) sums[i] += part[i][k];
  }
}

}  // namespace

Profile::Profile(std::vector<int> first) : first_(std::move(first)) {
  start_.push_back(0);
  for (int i = 0; i < size(); ++i) start_.push_back(start_[i] + i + 1 - first_[i]);
}

void multiply(const Profile& profile, const double* A, const double* x, double* y) {
  std::fill_n(y, profile.size(), 0.0);
  for (int i = 0; i < profile.size(); ++i) {
    const double* row = profile.row(A, i);
    double sum = 0;
    for (int j = profile.first(i); j < i; ++j) {
      sum += row[j] * x[j];
      y[j] += row[j] * x[i];
    }
    y[i] += sum + row[i] * x[i];
  }
}

void ProfileFactor::factor(const Profile& profile, std::span<const RowBlock> blocks,
                           const std::vector<double>& A, double null) {
  rank_ = 0;
  order_.resize(profile.size());
  std::iota(order_.begin(), order_.end(), 0);
  pivot_.assign(profile.size(), 0.0);
  L_.resize(A.size());
  // Rows of a panel meet each row before the panel while that is in the cache.
  constexpr size_t panel = 8;
  for (size_t at = 0; at < blocks.size(); at += panel) {
    const auto own = blocks.subspan(at, std::min(panel, blocks.size() - at));
    int begin = own[0].row;
    for (const RowBlock& block : own) begin = std::min(begin, profile.first(block.row));
    for (int j = begin; j < own[0].row; ++j)
      for (const RowBlock& block : own)
        if (profile.first(block.row) <= j) eliminate(profile, block, j, A);
    for (const RowBlock& block : own) {
      for (int j = std::max(profile.first(block.row), own[0].row); j < block.row; ++j)
        eliminate(profile, block, j, A);
      factor_block(profile, block, A, null);
    }
  }
}

/// Column j of the rows of a block.
void ProfileFactor::eliminate(const Profile& profile, RowBlock block, int j,
                              const std::vector<double>& A) {
  const int begin = profile.first(block.row);
  const double* const other = profile.row(L_.data(), j);
  const double *given[6], *rows[6];
  for (int i = 0; i < block.n; ++i) {
    LINKWISE_ASSERT(profile.first(block.row + i) == begin, "rows of a block start in one column");
    given[i] = profile.row(A.data(), block.row + i);
    rows[i] = profile.row(L_.data(), block.row + i);
  }
  double sums[6] = {};
  const bool taken = pivot_[j] > 0;
  if (taken)
    with_dim(block.n, [&](auto n) {
      if constexpr (n.n > 0)
        products_of<n.n>(rows, other, std::max(begin, profile.first(j)), j, sums);
    });
  for (int i = 0; i < block.n; ++i)
    profile.row(L_.data(), block.row + i)[j] =
        taken ? (given[i][order_[j]] - sums[i]) / other[j] : 0;
}

/// What the rows before leave of a block is factored by pivoting.
void ProfileFactor::factor_block(const Profile& profile, RowBlock block,
                                 const std::vector<double>& A, double null) {
  const int begin = profile.first(block.row), end = block.row + block.n;
  const auto row = [&](int i) { return profile.row(L_.data(), i); };
  for (int i = block.row; i < end; ++i)
    pivot_[i] = profile.row(A.data(), i)[i] - product_of(row(i), row(i), begin, block.row);
  for (int k = block.row; k < end; ++k) {
    const int p = static_cast<int>(std::max_element(pivot_.begin() + k, pivot_.begin() + end) -
                                   pivot_.begin());
    if (!(pivot_[p] > null)) {
      for (int i = k; i < end; ++i) {
        std::fill(row(i) + k, row(i) + i + 1, 0.0);
        pivot_[i] = 0;
      }
      return;
    }
    std::swap(order_[k], order_[p]);
    std::swap(pivot_[k], pivot_[p]);
    std::swap_ranges(row(k) + begin, row(k) + k, row(p) + begin);
    row(k)[k] = std::sqrt(pivot_[k]);
    for (int i = k + 1; i < end; ++i) {
      const int r = std::max(order_[i], order_[k]), c = std::min(order_[i], order_[k]);
      const double x = profile.row(A.data(), r)[c] - product_of(row(i), row(k), begin, k);
      row(i)[k] = x / row(k)[k];
      pivot_[i] -= row(i)[k] * row(i)[k];
    }
    ++rank_;
  }
}

int ProfileFactor::rank_above(double least) const {
  return static_cast<int>(
      std::count_if(pivot_.begin(), pivot_.end(), [&](double pivot) { return pivot > least; }));
}

double ProfileFactor::smallest_pivot() const {
  double least = 0, most = 0;
  for (const double pivot : pivot_) {
    if (pivot > 0 && !(least > 0 && least < pivot)) least = pivot;
    most = std::max(most, pivot);
  }
  return most > 0 ? least / most : 1;
}

void ProfileFactor::solve_once(const Profile& profile, const double* b, double* x) {
  const int n = profile.size();
  y_.assign(n, 0.0);
  for (int i = 0; i < n; ++i) {
    if (!(pivot_[i] > 0)) continue;
    const double* row = profile.row(L_.data(), i);
    y_[i] = (b[order_[i]] - product_of(row, y_.data(), profile.first(i), i)) / row[i];
  }
  for (int i = n - 1; i >= 0; --i) {
    if (!(pivot_[i] > 0)) continue;
    const double* row = profile.row(L_.data(), i);
    y_[i] /= row[i];
    for (int j = profile.first(i); j < i; ++j) y_[j] -= row[j] * y_[i];
  }
  for (int i = 0; i < n; ++i) x[order_[i]] = y_[i];
}

/// Refined once: what rounding leaves of a nearly dependent direction is large.
double ProfileFactor::solve(const Profile& profile, const std::vector<double>& A, const double* b,
                            double* x) {
  const auto n = static_cast<size_t>(profile.size());
  given_.assign(b, b + n);
  left_ = given_;
  more_.resize(n);
  product_.resize(n);
  std::fill_n(x, n, 0.0);
  for (int twice = 0; twice < 2; ++twice) {
    solve_once(profile, left_.data(), more_.data());
    for (size_t i = 0; i < n; ++i) x[i] += more_[i];
    multiply(profile, A.data(), x, product_.data());
    for (size_t i = 0; i < n; ++i) left_[i] = given_[i] - product_[i];
  }
  return largest(left_);
}

void ShiftedFactor::factor(const Profile& profile, const std::vector<double>& A) {
  L_ = A;
  for (int i = 0; i < profile.size(); ++i) {
    double* const row = profile.row(L_.data(), i);
    const int begin = profile.first(i);
    double pivot = row[i] + shift;
    for (int j = begin; j < i; ++j) {
      const double* other = profile.row(L_.data(), j);
      row[j] -= product_of(row, other, std::max(begin, profile.first(j)), j);
      row[j] /= other[j];
      pivot -= row[j] * row[j];
    }
    pivot = std::max(pivot, 0.1 * shift);  // rounding may eat the shift
    row[i] = std::sqrt(pivot);
  }
}

void ShiftedFactor::solve_once(const Profile& profile, double* x) const {
  for (int i = 0; i < profile.size(); ++i) {
    const double* row = profile.row(L_.data(), i);
    x[i] = (x[i] - product_of(row, x, profile.first(i), i)) / row[i];
  }
  for (int i = profile.size() - 1; i >= 0; --i) {
    const double* row = profile.row(L_.data(), i);
    x[i] /= row[i];
    for (int j = profile.first(i); j < i; ++j) x[j] -= row[j] * x[i];
  }
}

double ShiftedFactor::solve(const Profile& profile, const std::vector<double>& A, const double* b,
                            double* x) {
  const auto n = static_cast<size_t>(profile.size());
  given_.assign(b, b + n);
  std::fill_n(x, n, 0.0);
  product_.resize(n);
  double missed = largest(given_);
  left_ = given_;
  for (int step = 0; step < most_steps && missed > 0; ++step) {
    more_ = left_;
    solve_once(profile, more_.data());
    for (size_t i = 0; i < n; ++i) more_[i] += x[i];
    multiply(profile, A.data(), more_.data(), product_.data());
    for (size_t i = 0; i < n; ++i) left_[i] = given_[i] - product_[i];
    const double now = largest(left_);
    if (!(now < missed)) break;  // rounding errors are all that is left
    missed = now;
    std::copy(more_.begin(), more_.end(), x);
  }
  return missed;
}

}  // namespace linkwise
