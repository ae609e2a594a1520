#pragma once

#include <array>
#include <cmath>

#include "linkwise/linear/block.hpp"

namespace linkwise {

/// Eigenvalues and orthonormal eigenvectors (columns of `vectors`) of the symmetric n x n block a,
/// n <= 6, by cyclic Jacobi rotations [golub2013, section 8.5]: accurate to the last digits for
/// blocks of this size. a is destroyed; the eigenvalues are left unsorted.
inline void symmetric_eigen(int n, Block& a, std::array<double, 6>& values, Block& vectors) {
  vectors.fill(0.0);
  for (int i = 0; i < n; ++i) vectors[7 * i] = 1.0;
  for (int sweep = 0; sweep < 30; ++sweep) {
    double off = 0.0, scale = 0.0;
    for (int i = 0; i < n; ++i) {
      scale += a[7 * i] * a[7 * i];
      for (int j = 0; j < i; ++j) off += a[6 * i + j] * a[6 * i + j];
    }
    if (off <= 1e-34 * scale) break;
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q) {
        const double apq = a[6 * p + q];
        if (apq == 0.0) continue;
        const double theta = (a[7 * q] - a[7 * p]) / (2.0 * apq);
        const double t =
            (theta >= 0.0 ? 1.0 : -1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1.0));
        const double c = 1.0 / std::sqrt(t * t + 1.0), s = t * c;
        for (int k = 0; k < n; ++k) {
          const double x = a[6 * k + p], y = a[6 * k + q];
          a[6 * k + p] = c * x - s * y;
          a[6 * k + q] = s * x + c * y;
        }
        for (int k = 0; k < n; ++k) {
          const double x = a[6 * p + k], y = a[6 * q + k];
          a[6 * p + k] = c * x - s * y;
          a[6 * q + k] = s * x + c * y;
        }
        for (int k = 0; k < n; ++k) {
          const double x = vectors[6 * k + p], y = vectors[6 * k + q];
          vectors[6 * k + p] = c * x - s * y;
          vectors[6 * k + q] = s * x + c * y;
        }
      }
  }
  for (int i = 0; i < n; ++i) values[i] = a[7 * i];
}

}  // namespace linkwise
