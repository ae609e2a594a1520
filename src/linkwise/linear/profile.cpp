#include "linkwise/linear/profile.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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

void ShiftedFactor::factor(const Profile& profile, const std::vector<double>& A) {
  L_ = A;
  for (int i = 0; i < profile.size(); ++i) {
    double* const row = profile.row(L_.data(), i);
    const int begin = profile.first(i);
    double pivot = row[i] + shift;
    for (int j = begin; j < i; ++j) {
      const double* other = profile.row(L_.data(), j);
      double x = row[j];
      for (int l = std::max(begin, profile.first(j)); l < j; ++l) x -= row[l] * other[l];
      row[j] = x / other[j];
      pivot -= row[j] * row[j];
    }
    pivot = std::max(pivot, 0.1 * shift);  // rounding may eat the shift
    row[i] = std::sqrt(pivot);
  }
}

int ShiftedFactor::rank_above(const Profile& profile, double least) const {
  int count = 0;
  for (int i = 0; i < profile.size(); ++i) {
    const double root = profile.row(L_.data(), i)[i];
    count += root * root > least;
  }
  return count;
}

void ShiftedFactor::solve_once(const Profile& profile, double* x) const {
  for (int i = 0; i < profile.size(); ++i) {
    const double* row = profile.row(L_.data(), i);
    for (int j = profile.first(i); j < i; ++j) x[i] -= row[j] * x[j];
    x[i] /= row[i];
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
