#pragma once
// Root of a symmetric block that need not have an inverse, by Cholesky.
#include <cmath>

#include "linkwise/linear/block.hpp"

namespace linkwise {

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
