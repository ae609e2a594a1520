#pragma once
// Symmetric and lower triangular matrices are kept as the rows of their lower triangle, one after
// the other.
#include "linkwise/base/inline.hpp"

namespace linkwise {

LW_INLINE constexpr int packed(int i, int j) {
  return i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i;
}

}  // namespace linkwise
