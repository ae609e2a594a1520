#include "linkwise/linear/pivoted_qr.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace linkwise {

void PivotedQr::factor(int m, int n, const double* A, double null) {
  m_ = m;
  n_ = n;
  rank_ = 0;
  rows_.resize(m);
  order_.resize(n);
  std::iota(rows_.begin(), rows_.end(), 0);
  std::iota(order_.begin(), order_.end(), 0);
  std::vector<double> size(m);
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < n; ++j)
      size[i] = std::max(size[i], std::abs(A[static_cast<size_t>(i) * n + j]));
  std::stable_sort(rows_.begin(), rows_.end(), [&](int a, int b) { return size[a] > size[b]; });
  R_.resize(static_cast<size_t>(m) * n);
  for (int i = 0; i < m; ++i) std::copy_n(A + static_cast<size_t>(rows_[i]) * n, n, row(i));
  v_.clear();
  scale_.clear();
  for (int k = 0; k < std::min(m, n); ++k) {
    std::vector<double> left(n);
    for (int i = k; i < m; ++i)
      for (int j = k; j < n; ++j) left[j] += row(i)[j] * row(i)[j];
    const int p = static_cast<int>(std::max_element(left.begin() + k, left.end()) - left.begin());
    const double length = std::sqrt(left[p]);
    if (!(length > null)) break;
    std::swap(order_[k], order_[p]);
    for (int i = 0; i < m; ++i) std::swap(row(i)[k], row(i)[p]);
    v_.resize(v_.size() + m);
    double* const v = &v_[static_cast<size_t>(k) * m];
    for (int i = k; i < m; ++i) v[i] = row(i)[k];
    v[k] += std::copysign(length, v[k]);
    scale_.push_back(1 / (length * std::abs(v[k])));
    for (int j = k; j < n; ++j) reflect(k, R_.data() + j, n);
    ++rank_;
  }
}

/// x <- (1 - scale v v^T) x.
void PivotedQr::reflect(int k, double* x, size_t stride) const {
  const double* const v = &v_[static_cast<size_t>(k) * m_];
  double sum = 0;
  for (int i = k; i < m_; ++i) sum += v[i] * x[i * stride];
  sum *= scale_[k];
  for (int i = k; i < m_; ++i) x[i * stride] -= sum * v[i];
}

void PivotedQr::solve(const double* b, double* x) {
  y_.resize(m_);
  for (int i = 0; i < m_; ++i) y_[i] = b[rows_[i]];
  for (int k = 0; k < rank_; ++k) reflect(k, y_.data(), 1);
  for (int i = rank_ - 1; i >= 0; --i) {
    for (int j = i + 1; j < rank_; ++j) y_[i] -= row(i)[j] * y_[j];
    y_[i] /= row(i)[i];
  }
  std::fill_n(x, n_, 0.0);
  for (int i = 0; i < rank_; ++i) x[order_[i]] = y_[i];
}

void PivotedQr::solve_normal(const double* b, double* x) {
  y_.resize(std::max(m_, n_));
  for (int i = 0; i < rank_; ++i) {
    y_[i] = b[order_[i]];
    for (int j = 0; j < i; ++j) y_[i] -= row(j)[i] * y_[j];
    y_[i] /= row(i)[i];
  }
  for (int i = rank_ - 1; i >= 0; --i) {
    for (int j = i + 1; j < rank_; ++j) y_[i] -= row(i)[j] * y_[j];
    y_[i] /= row(i)[i];
  }
  std::fill_n(x, n_, 0.0);
  for (int i = 0; i < rank_; ++i) x[order_[i]] = y_[i];
}

std::vector<double> PivotedQr::seen() const {
  std::vector<double> out(static_cast<size_t>(rank_) * n_);
  for (int i = 0; i < rank_; ++i)
    for (int j = i; j < n_; ++j) out[static_cast<size_t>(i) * n_ + order_[j]] = row(i)[j];
  orthonormalise(n_, out);
  return out;
}

std::vector<double> PivotedQr::unseen() const {
  std::vector<double> out(static_cast<size_t>(n_ - rank_) * n_);
  for (int c = rank_; c < n_; ++c) {
    double* const x = &out[static_cast<size_t>(c - rank_) * n_];
    x[order_[c]] = 1;
    for (int i = rank_ - 1; i >= 0; --i) {
      double sum = row(i)[c];
      for (int j = i + 1; j < rank_; ++j) sum += row(i)[j] * x[order_[j]];
      x[order_[i]] = -sum / row(i)[i];
    }
  }
  orthonormalise(n_, out);
  return out;
}

void orthonormalise(int n, std::vector<double>& vectors) {
  const size_t width = n, count = n > 0 ? vectors.size() / width : 0;
  for (size_t k = 0; k < count; ++k) {
    double* const x = &vectors[k * width];
    const auto normalise = [&] {
      const double length = std::sqrt(std::inner_product(x, x + width, x, 0.0));
      for (size_t i = 0; i < width; ++i) x[i] /= length;
    };
    normalise();
    // Twice is enough [golub2013, section 5.2.8].
    for (int pass = 0; pass < 2; ++pass) {
      for (size_t l = 0; l < k; ++l) {
        const double* const y = &vectors[l * width];
        const double part = std::inner_product(x, x + width, y, 0.0);
        for (size_t i = 0; i < width; ++i) x[i] -= part * y[i];
      }
      normalise();
    }
  }
}

}  // namespace linkwise
