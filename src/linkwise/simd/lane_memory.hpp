#pragma once
// Lanes from and to numbers side by side, wherever these begin.
#include <cstring>

#include "linkwise/simd/lanes.hpp"

namespace linkwise {

template <class S>
LW_INLINE S load_lanes(const double* from) {
  S x;
  std::memcpy(&x, from, sizeof x);
  return x;
}

template <class S>
LW_INLINE void store_lanes(double* to, const S& x) {
  std::memcpy(to, &x, sizeof x);
}

}  // namespace linkwise
