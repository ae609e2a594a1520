#pragma once
// Cholesky factor of a small symmetric matrix, packed, on one scalar or on lanes. The diagonal of
// the factor is kept as its reciprocal. linear/ldlt.hpp avoids the square roots, which a recursion
// along a chain waits for.
#include "linkwise/base/packed.hpp"
#include "linkwise/simd/lanes.hpp"

namespace linkwise {

/// a <- L of a = L L^T, n x n. False if a pivot of some lane is not above this part of its diagonal
/// entry.
template <class S>
LW_INLINE bool cholesky_factor(int n, S* a, double smallest_pivot) {
  bool positive = true;
  for (int i = 0; i < n; ++i) {
    S* const row = a + packed(i, 0);
    for (int j = 0; j <= i; ++j) {
      const S* const other = a + packed(j, 0);
      const S whole = row[j];
      S x = whole;
      for (int l = 0; l < j; ++l) x = x - row[l] * other[l];
      if (i == j) {
        positive &= is_positive(S(x - smallest_pivot * whole));
        row[i] = 1.0 / square_root(x);
      } else {
        row[j] = x * other[j];
      }
    }
  }
  return positive;
}

/// x <- (L L^T)^-1 x.
template <class S>
LW_INLINE void cholesky_solve(int n, const S* L, S* x) {
  for (int i = 0; i < n; ++i) {
    const S* const row = L + packed(i, 0);
    for (int l = 0; l < i; ++l) x[i] = x[i] - row[l] * x[l];
    x[i] = x[i] * row[i];
  }
  for (int i = n - 1; i >= 0; --i) {
    for (int l = i + 1; l < n; ++l) x[i] = x[i] - L[packed(l, i)] * x[l];
    x[i] = x[i] * L[packed(i, i)];
  }
}

}  // namespace linkwise
