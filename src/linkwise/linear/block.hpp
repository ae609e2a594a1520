#pragma once
// Small dense blocks: at most 6 x 6 numbers, row-major with stride 6, of which the top-left
// rows x cols are used. Every kernel is a template on the two dimensions so that its loops unroll;
// with_dims() picks the instance once per block. Dimension 5 (revolute, prismatic) and 6 (welded)
// are the common ones, all others (0..6) work alike.

#include <array>
#include <cmath>

#include "linkwise/base/inline.hpp"

namespace linkwise {

inline constexpr int block_stride = 6;
using Block = std::array<double, block_stride * block_stride>;

/// y += sign * B x.
template <int rows, int cols>
LW_INLINE void block_multiply_add(const double* block, const double* x, double* y, double sign) {
#pragma GCC unroll 6
  for (int i = 0; i < rows; ++i) {
    double sum = 0.0;
#pragma GCC unroll 6
    for (int j = 0; j < cols; ++j) sum += block[block_stride * i + j] * x[j];
    y[i] += sign * sum;
  }
}

/// y += sign * B^T x.
template <int rows, int cols>
LW_INLINE void block_transpose_multiply_add(const double* block, const double* x, double* y,
                                            double sign) {
#pragma GCC unroll 6
  for (int j = 0; j < cols; ++j) {
    double sum = 0.0;
#pragma GCC unroll 6
    for (int i = 0; i < rows; ++i) sum += block[block_stride * i + j] * x[i];
    y[j] += sign * sum;
  }
}

template <int value>
struct Dim {
  static constexpr int n = value;
};

/// Calls f(Dim<d>{}) with the dimension d as a compile-time constant.
template <class F>
LW_INLINE decltype(auto) with_dim(int d, F&& f) {
  switch (d) {
    case 5:
      return f(Dim<5>{});
    case 6:
      return f(Dim<6>{});
    case 4:
      return f(Dim<4>{});
    case 3:
      return f(Dim<3>{});
    case 2:
      return f(Dim<2>{});
    case 1:
      return f(Dim<1>{});
    default:
      return f(Dim<0>{});
  }
}

/// Calls f(Dim<rows>{}, Dim<cols>{}).
template <class F>
LW_INLINE decltype(auto) with_dims(int rows, int cols, F&& f) {
  return with_dim(rows, [&](auto r) -> decltype(auto) {
    return with_dim(cols, [&](auto c) -> decltype(auto) { return f(r, c); });
  });
}

/// y += sign * B x, dimensions known at run time.
inline void block_multiply_add(int rows, int cols, const Block& block, const double* x, double* y,
                               double sign = 1.0) {
  with_dims(rows, cols,
            [&](auto r, auto c) { block_multiply_add<r.n, c.n>(block.data(), x, y, sign); });
}

/// y += sign * B^T x, dimensions known at run time.
inline void block_transpose_multiply_add(int rows, int cols, const Block& block, const double* x,
                                         double* y, double sign = 1.0) {
  with_dims(rows, cols, [&](auto r, auto c) {
    block_transpose_multiply_add<r.n, c.n>(block.data(), x, y, sign);
  });
}

/// Lower R with G = R R^T, n x n, zeros elsewhere. A pivot of at most `dependent` gives a zero
/// column; one below `least` fails.
inline bool cholesky_root(int n, const Block& G, double least, double dependent, Block& R) {
  R.fill(0.0);
  for (int j = 0; j < n; ++j) {
    double pivot = G[7 * j];
    for (int k = 0; k < j; ++k) pivot -= R[6 * j + k] * R[6 * j + k];
    if (!(pivot >= least)) return false;
    if (pivot <= dependent) continue;
    R[7 * j] = std::sqrt(pivot);
    for (int i = j + 1; i < n; ++i) {
      double sum = G[6 * i + j];
      for (int k = 0; k < j; ++k) sum -= R[6 * i + k] * R[6 * j + k];
      R[6 * i + j] = sum / R[7 * j];
    }
  }
  return true;
}

}  // namespace linkwise
