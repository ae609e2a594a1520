#pragma once
// A lane is an independent item (another system, or another piece of one chain), never a component
// of a 3-vector: kernels are templates on the scalar S and need no shuffles.
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "linkwise/base/inline.hpp"

#ifndef LINKWISE_LANES
#define LINKWISE_LANES 4
#endif

namespace linkwise {

template <int W>
struct LaneTypes {
  typedef double real __attribute__((vector_size(8 * W)));
  typedef std::int64_t integer __attribute__((vector_size(8 * W)));
};
template <int W>
using Lanes = typename LaneTypes<W>::real;

/// The lane width that this CPU target is compiled for.
inline constexpr int native_lanes = LINKWISE_LANES;

template <class S>
inline constexpr int lane_count = sizeof(S) / sizeof(double);

template <class S>
struct IntegerOf {
  using type = typename LaneTypes<lane_count<S>>::integer;
};
template <>
struct IntegerOf<double> {
  using type = std::int64_t;
};

template <class S>
LW_INLINE S broadcast(double value) {
  return S{} + value;
}

LW_INLINE double lane(double value, int) { return value; }
template <class S>
LW_INLINE double lane(const S& value, int index) {
  return value[index];
}

/// In all lanes.
template <class S>
LW_INLINE bool is_positive(const S& d) {
  bool all = true;
  for (int l = 0; l < lane_count<S>; ++l) all &= lane(d, l) > 0;
  return all;
}

template <class S>
LW_INLINE void set_lane(S& value, int index, double item) {
  if constexpr (std::is_same_v<S, double>)
    value = item;
  else
    value[index] = item;
}

template <class S>
LW_INLINE S absolute(const S& x) {
  if constexpr (std::is_same_v<S, double>)
    return std::abs(x);
  else
    return x < 0 ? -x : x;
}
template <class S>
LW_INLINE S larger(const S& a, const S& b) {
  return a > b ? a : b;
}
/// The smaller one; NaN if b is NaN.
template <class S>
LW_INLINE S smaller(const S& a, const S& b) {
  return a < b ? a : b;
}

template <class S>
LW_INLINE S square_root(S x) {
  if constexpr (std::is_same_v<S, double>) {
    return std::sqrt(x);
  } else {
    S result;
    for (int i = 0; i < lane_count<S>; ++i) result[i] = __builtin_sqrt(x[i]);
    return result;
  }
}

}  // namespace linkwise
