#pragma once

#include <algorithm>
#include <cmath>

namespace linkwise {

/// Eigenvalues and orthonormal eigenvectors (columns of `vectors`) of the symmetric n x n matrix a,
/// whose rows are `stride` apart, by cyclic Jacobi rotations [golub2013, section 8.5]: accurate to
/// the last digits for matrices as small as these. a is destroyed; the eigenvalues are left
/// unsorted.
template <int stride>
void symmetric_eigen(int n, double* a, double* values, double* vectors) {
  std::fill_n(vectors, stride * stride, 0.0);
  for (int i = 0; i < n; ++i) vectors[(stride + 1) * i] = 1.0;
  for (int sweep = 0; sweep < 30; ++sweep) {
    double off = 0.0, scale = 0.0;
    for (int i = 0; i < n; ++i) {
      scale += a[(stride + 1) * i] * a[(stride + 1) * i];
      for (int j = 0; j < i; ++j) off += a[stride * i + j] * a[stride * i + j];
    }
    if (off <= 1e-34 * scale) break;
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q) {
        const double apq = a[stride * p + q];
        if (apq == 0.0) continue;
        const double theta = (a[(stride + 1) * q] - a[(stride + 1) * p]) / (2.0 * apq);
        const double t =
            (theta >= 0.0 ? 1.0 : -1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1.0));
        const double c = 1.0 / std::sqrt(t * t + 1.0), s = t * c;
        for (int k = 0; k < n; ++k) {
          const double x = a[stride * k + p], y = a[stride * k + q];
          a[stride * k + p] = c * x - s * y;
          a[stride * k + q] = s * x + c * y;
        }
        for (int k = 0; k < n; ++k) {
          const double x = a[stride * p + k], y = a[stride * q + k];
          a[stride * p + k] = c * x - s * y;
          a[stride * q + k] = s * x + c * y;
        }
        for (int k = 0; k < n; ++k) {
          const double x = vectors[stride * k + p], y = vectors[stride * k + q];
          vectors[stride * k + p] = c * x - s * y;
          vectors[stride * k + q] = s * x + c * y;
        }
      }
  }
  for (int i = 0; i < n; ++i) values[i] = a[(stride + 1) * i];
}

}  // namespace linkwise
