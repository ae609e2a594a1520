#pragma once
// Lanes into rows of numbers, one per system.
#include <cstddef>
#include <utility>

#include "linkwise/simd/lanes.hpp"

namespace linkwise {

/// A step of transpose(), between vectors whose numbers in the tile differ by `step`.
template <int step, class S, int... l>
LW_INLINE void exchange(S& a, S& b, std::integer_sequence<int, l...>) {
  constexpr int W = lane_count<S>;
  const S first = __builtin_shufflevector(a, b, ((l & step) ? W + l - step : l)...);
  b = __builtin_shufflevector(a, b, ((l & step) ? W + l : l + step)...);
  a = first;
}

/// tile[i][l] becomes tile[l][i].
template <int step = 1, class S>
LW_INLINE void transpose(S (&tile)[lane_count<S>]) {
  constexpr int W = lane_count<S>;
  static_assert((W & (W - 1)) == 0, "a power of two");
  if constexpr (step < W) {
#pragma GCC unroll 8
    for (int i = 0; i < W; ++i)
      if (!(i & step))
        exchange<step>(tile[i], tile[i + step], std::make_integer_sequence<int, W>());
    transpose<2 * step>(tile);
  }
}

/// to[l * stride + k] = from[k][l] for k < n and the first `lanes` lanes.
template <class S>
void lanes_to_rows(const S* from, size_t n, int lanes, double* to, size_t stride) {
  constexpr int W = lane_count<S>;
  size_t k = 0;
  if constexpr (W > 2) {  // shuffles of two numbers cost more than they save
    typedef double Unaligned __attribute__((vector_size(8 * W), aligned(8), may_alias));
    for (; k + W <= n; k += W) {
      S tile[W];
#pragma GCC unroll 8
      for (int i = 0; i < W; ++i) tile[i] = from[k + i];
      transpose(tile);
#pragma GCC unroll 8
      for (int l = 0; l < W; ++l)
        if (l < lanes) *reinterpret_cast<Unaligned*>(to + l * stride + k) = tile[l];
    }
  }
  for (int l = 0; l < lanes; ++l)
    for (size_t i = k; i < n; ++i) to[l * stride + i] = from[i][l];
}

}  // namespace linkwise
