#pragma once
// Operations on long vectors, tile by tile. Sums run in eight interleaved partial sums per tile, a
// fixed shape: fast, more accurate than one running sum, and the same bits on every run, for every
// vector width and any number of threads.

#include <cstddef>
#include <span>

#include "linkwise/exec/tiles.hpp"

namespace linkwise {

template <class Term>
inline double interleaved_sum(std::size_t begin, std::size_t end, Term&& term) {
  double part[8] = {};
  std::size_t i = begin;
  for (; i + 8 <= end; i += 8)
    for (std::size_t k = 0; k < 8; ++k) part[k] += term(i + k);
  for (std::size_t k = 0; i < end; ++i, ++k) part[k] += term(i);
  return ((part[0] + part[4]) + (part[2] + part[6])) + ((part[1] + part[5]) + (part[3] + part[7]));
}

inline double dot(std::span<const double> a, std::span<const double> b,
                  const Executor& executor = Executor()) {
  const double *p = a.data(), *q = b.data();
  const Tiles tiles(static_cast<int>(a.size()), TileOf::entries);
  return tiles.sum(executor, [=](int begin, int end) {
    return interleaved_sum(begin, end, [=](std::size_t i) { return p[i] * q[i]; });
  });
}

inline double sum_of_squares(std::span<const double> a, const Executor& executor = Executor()) {
  return dot(a, a, executor);
}

/// f(i) for every i below n.
template <class F>
inline void for_each_entry(std::size_t n, const Executor& executor, F&& f) {
  const Tiles tiles(static_cast<int>(n), TileOf::entries);
  tiles.for_each(executor, [&](int, int begin, int end) {
    for (std::size_t i = begin; i < static_cast<std::size_t>(end); ++i) f(i);
  });
}

/// y += factor x.
inline void add_scaled(double factor, std::span<const double> x, std::span<double> y,
                       const Executor& executor = Executor()) {
  for_each_entry(y.size(), executor, [=](std::size_t i) { y[i] += factor * x[i]; });
}

/// y = x - y.
inline void subtract_from(std::span<const double> x, std::span<double> y,
                          const Executor& executor = Executor()) {
  for_each_entry(y.size(), executor, [=](std::size_t i) { y[i] = x[i] - y[i]; });
}

}  // namespace linkwise
