#pragma once
// L D L^T of one symmetric block, without square roots: five dependent divisions per 5 x 5 block
// instead of five square roots and divisions. These are what the recursion along a chain waits for.
// Packed lower triangle; the diagonal holds 1 / D.

#include <array>
#include <cmath>

#include "linkwise/base/packed.hpp"
#include "linkwise/linear/block.hpp"

namespace linkwise {

using PackedLower = std::array<double, 21>;

/// Packs the lower triangle of a block.
template <int dim>
LW_INLINE void pack_lower(const double* block, double* lower) {
#pragma GCC unroll 6
  for (int i = 0; i < dim; ++i)
#pragma GCC unroll 6
    for (int j = 0; j <= i; ++j) lower[packed(i, j)] = block[block_stride * i + j];
}

/// Factors in place; false when a pivot is not a positive finite number.
template <int dim>
LW_INLINE bool ldlt_factor(double* a) {
  bool positive = true;
#pragma GCC unroll 6
  for (int j = 0; j < dim; ++j) {
    const double pivot = a[packed(j, j)];
    // Negated so that NaN fails too; infinity gives a zero inverse and NaN further on.
    positive = positive && pivot > 0.0 && pivot <= 1.7976931348623157e308;
    const double inverse = 1.0 / pivot;
    a[packed(j, j)] = inverse;
    double column[6];
#pragma GCC unroll 6
    for (int i = j + 1; i < dim; ++i) {
      column[i] = a[packed(i, j)];
      a[packed(i, j)] *= inverse;
    }
#pragma GCC unroll 6
    for (int i = j + 1; i < dim; ++i)
#pragma GCC unroll 6
      for (int k = j + 1; k <= i; ++k) a[packed(i, k)] -= a[packed(i, j)] * column[k];
  }
  return positive;
}

/// x <- L^-1 x.
template <int dim>
LW_INLINE void ldlt_forward(const double* a, double* x) {
#pragma GCC unroll 6
  for (int i = 1; i < dim; ++i)
#pragma GCC unroll 6
    for (int j = 0; j < i; ++j) x[i] -= a[packed(i, j)] * x[j];
}

/// x <- D^-1 x.
template <int dim>
LW_INLINE void ldlt_scale(const double* a, double* x) {
#pragma GCC unroll 6
  for (int i = 0; i < dim; ++i) x[i] *= a[packed(i, i)];
}

/// x <- L^-T x.
template <int dim>
LW_INLINE void ldlt_backward(const double* a, double* x) {
#pragma GCC unroll 6
  for (int i = dim - 1; i > 0; --i)
#pragma GCC unroll 6
    for (int j = 0; j < i; ++j) x[j] -= a[packed(i, j)] * x[i];
}

/// B <- L^-1 B, for a dim x cols block.
template <int dim, int cols>
LW_INLINE void ldlt_forward_block(const double* a, double* b) {
#pragma GCC unroll 6
  for (int i = 1; i < dim; ++i)
#pragma GCC unroll 6
    for (int j = 0; j < i; ++j)
#pragma GCC unroll 6
      for (int k = 0; k < cols; ++k)
        b[block_stride * i + k] -= a[packed(i, j)] * b[block_stride * j + k];
}

/// S <- S - B^T D^-1 B, S packed cols x cols, B = L^-1 times the coupling block.
template <int dim, int cols>
LW_INLINE void ldlt_downdate(const double* a, const double* b, double* s) {
#pragma GCC unroll 6
  for (int i = 0; i < dim; ++i) {
    double scaled[6];
#pragma GCC unroll 6
    for (int k = 0; k < cols; ++k) scaled[k] = b[block_stride * i + k] * a[packed(i, i)];
#pragma GCC unroll 6
    for (int k = 0; k < cols; ++k)
#pragma GCC unroll 6
      for (int l = 0; l <= k; ++l) s[packed(k, l)] -= scaled[k] * b[block_stride * i + l];
  }
}

}  // namespace linkwise
