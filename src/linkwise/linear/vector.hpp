#pragma once
// Operations on long vectors. Sums run in eight interleaved partial sums of fixed shape: fast, more
// accurate than one running sum, and the same bits on every run and for every vector width.

#include <cstddef>
#include <span>

namespace linkwise {

template <class Term>
inline double interleaved_sum(std::size_t count, Term&& term) {
  double part[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8)
    for (std::size_t k = 0; k < 8; ++k) part[k] += term(i + k);
  for (std::size_t k = 0; i < count; ++i, ++k) part[k] += term(i);
  return ((part[0] + part[4]) + (part[2] + part[6])) + ((part[1] + part[5]) + (part[3] + part[7]));
}

inline double dot(std::span<const double> a, std::span<const double> b) {
  const double *p = a.data(), *q = b.data();
  return interleaved_sum(a.size(), [=](std::size_t i) { return p[i] * q[i]; });
}

inline double sum_of_squares(std::span<const double> a) { return dot(a, a); }

/// y += factor x.
inline void add_scaled(double factor, std::span<const double> x, std::span<double> y) {
  for (std::size_t i = 0; i < y.size(); ++i) y[i] += factor * x[i];
}

/// y = x - y.
inline void subtract_from(std::span<const double> x, std::span<double> y) {
  for (std::size_t i = 0; i < y.size(); ++i) y[i] = x[i] - y[i];
}

}  // namespace linkwise
