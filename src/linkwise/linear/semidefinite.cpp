#include "linkwise/linear/semidefinite.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "linkwise/base/packed.hpp"

namespace linkwise {
namespace {

double product(const double* a, const double* b, int n) {
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

void SemidefiniteFactor::factor(int n, const double* A, double null) {
  n_ = n;
  rank_ = 0;
  smallest_ = 1;
  order_.resize(n);
  std::iota(order_.begin(), order_.end(), 0);
  L_.assign(static_cast<size_t>(n) * n, 0.0);
  diagonal_.resize(n);
  for (int i = 0; i < n; ++i) diagonal_[i] = A[static_cast<size_t>(i) * n + i];
  double first = 0;
  for (int k = 0; k < n; ++k) {
    const int p = static_cast<int>(std::max_element(diagonal_.begin() + k, diagonal_.end()) -
                                   diagonal_.begin());
    if (!(diagonal_[p] > null)) break;
    std::swap(order_[k], order_[p]);
    std::swap(diagonal_[k], diagonal_[p]);
    std::swap_ranges(row(k), row(k) + k, row(p));
    if (k == 0) first = diagonal_[k];
    smallest_ = diagonal_[k] / first;
    const double pivot = std::sqrt(diagonal_[k]);
    row(k)[k] = pivot;
    for (int i = k + 1; i < n; ++i) {
      const size_t r = std::max(order_[i], order_[k]), c = std::min(order_[i], order_[k]);
      const double x = (A[r * n + c] - product(row(i), row(k), k)) / pivot;
      row(i)[k] = x;
      diagonal_[i] -= x * x;
    }
    ++rank_;
  }
  const int m = n - rank_;
  W_.assign(static_cast<size_t>(m) * rank_, 0.0);
  gram_.assign(static_cast<size_t>(m) * m, 0.0);
  for (int i = 0; i < m; ++i) {
    double* w = W_.data() + static_cast<size_t>(i) * rank_;
    std::copy_n(row(rank_ + i), rank_, w);
    for (int j = rank_ - 1; j >= 0; --j) {
      w[j] /= row(j)[j];
      for (int l = 0; l < j; ++l) w[l] -= w[j] * row(j)[l];
    }
  }
  for (int i = 0; i < m; ++i)
    for (int j = 0; j <= i; ++j) {
      const double* wi = W_.data() + static_cast<size_t>(i) * rank_;
      const double* wj = W_.data() + static_cast<size_t>(j) * rank_;
      double* gi = gram_.data() + static_cast<size_t>(i) * m;
      const double* gj = gram_.data() + static_cast<size_t>(j) * m;
      const double x = (i == j ? 1.0 : 0.0) + product(wi, wj, rank_) - product(gi, gj, j);
      gi[j] = i == j ? std::sqrt(x) : x / gj[j];
    }
}

int SemidefiniteFactor::rank_above(double least) const {
  int count = 0;
  while (count < rank_ && row(count)[count] * row(count)[count] > least) ++count;
  return count;
}

double SemidefiniteFactor::solve(const double* b, double* x) {
  const int m = n_ - rank_;
  y_.resize(n_);
  t_.assign(m, 0.0);
  given_.resize(n_);
  for (int i = 0; i < n_; ++i) given_[i] = b[order_[i]];
  for (int i = 0; i < rank_; ++i) y_[i] = (given_[i] - product(row(i), y_.data(), i)) / row(i)[i];
  double missed = 0;
  for (int i = rank_; i < n_; ++i)
    missed = std::max(missed, std::abs(given_[i] - product(row(i), y_.data(), rank_)));
  for (int i = rank_ - 1; i >= 0; --i) {
    y_[i] /= row(i)[i];
    for (int l = 0; l < i; ++l) y_[l] -= y_[i] * row(i)[l];
  }
  // The part along the null vectors taken out: x = y - N t, (1 + W W^T) t = -W y.
  for (int i = 0; i < m; ++i) {
    const double* g = gram_.data() + static_cast<size_t>(i) * m;
    const double* w = W_.data() + static_cast<size_t>(i) * rank_;
    t_[i] = (-product(w, y_.data(), rank_) - product(g, t_.data(), i)) / g[i];
  }
  for (int i = m - 1; i >= 0; --i) {
    const double* g = gram_.data() + static_cast<size_t>(i) * m;
    t_[i] /= g[i];
    for (int l = 0; l < i; ++l) t_[l] -= t_[i] * g[l];
  }
  for (int i = 0; i < m; ++i) {
    const double* w = W_.data() + static_cast<size_t>(i) * rank_;
    for (int l = 0; l < rank_; ++l) y_[l] += t_[i] * w[l];
    y_[rank_ + i] = -t_[i];
  }
  for (int i = 0; i < n_; ++i) x[order_[i]] = y_[i];
  return missed;
}

void SemidefiniteFactor::null_vector(int k, double* x) const {
  const double* w = W_.data() + static_cast<size_t>(k) * rank_;
  for (int i = 0; i < rank_; ++i) x[order_[i]] = -w[i];
  for (int i = rank_; i < n_; ++i) x[order_[i]] = i - rank_ == k;
}

}  // namespace linkwise
