#pragma once
// One joint's rows of the constraint-force system, eliminated: the dense part of
// constraint_elimination.hpp, on packed blocks of 5 or 6 rows. Loops are written so that they
// unroll before a vectoriser sees them: it would read in wide words what was just written in narrow
// ones, a stall of a dozen cycles each time.
#include <algorithm>

#include "linkwise/recursion/tolerances.hpp"
#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

/// X Phi' X^T (lower triangle by rows) and X Phi' of a joint, in the directions that it constrains.
template <class T>
struct Across {
  T W[21];
  T K[6][6];
};

template <class S>
struct JointElimination {
  S L[21];  ///< of S = L D L^T, packed, the diagonal holds 1 / D
  S f[6];   ///< D^-1 L^-1 b, in the end the joint's unknowns
  union {
    Compliance<S> Phi;  ///< of the outboard body, until the joint is eliminated
    S V[6][6];          ///< D^-1 Z
  };
  JointElimination() : Phi{} {}

  /// D: B^T Phi B + compliance, lower triangle by rows. Takes `before`, the parent's answer, to
  /// `after`; they may be the same. Returns a number that is positive when S is positive definite.
  template <int rows, class T>
  LW_INLINE S eliminate(S* D, const Across<T>& across, const Compliance<T>& before,
                        Compliance<S>& after) {
    constexpr int entries = packed(rows, 0);
#pragma GCC unroll 21
    for (int i = 0; i < entries; ++i) D[i] = D[i] + across.W[i];
    const Factor<rows> F = factor<rows>(D);
    // Entry by entry rather than row by row: what is summed stays in a register.
    S Z[rows][6], local[rows][6];  // what is stored elsewhere need not be read again
#pragma GCC unroll 6
    for (int c = 0; c < 6; ++c)
#pragma GCC unroll 6
      for (int i = 0; i < rows; ++i) {
        S z = across.K[i][c] + S{};
#pragma GCC unroll 6
        for (int j = 0; j < rows; ++j)
          if (j < i) z = z - F.L[packed(i, j)] * Z[j][c];
        Z[i][c] = z;
        local[i][c] = F.L[packed(i, i)] * z;
        V[i][c] = local[i][c];
      }
#pragma GCC unroll 6
    for (int i = 0; i < 6; ++i)
#pragma GCC unroll 6
      for (int j = 0; j <= i; ++j) {
        S x = entry(before, i, j) + S{};
#pragma GCC unroll 6
        for (int k = 0; k < rows; ++k) x = x - local[k][i] * Z[k][j];
        entry(after, i, j) = x;
      }
    return F.least;
  }

  /// A joint to the ground, which does not answer.
  template <int rows>
  LW_INLINE S eliminate_root(const S* D) {
    const S least = factor<rows>(D).least;
    for (auto& row : V) std::fill(row, row + 6, S{});
    return least;
  }

  /// y = L^-1 b and f = D^-1 y; returns what that takes from the parent's free acceleration.
  template <int rows>
  LW_INLINE Motion<S> reduce(const S* b) {
    S y[rows];
    Motion<S> taken{};
#pragma GCC unroll 6
    for (int i = 0; i < rows; ++i) {
      y[i] = b[i];
#pragma GCC unroll 6
      for (int j = 0; j < rows; ++j)
        if (j < i) y[i] = y[i] - L[packed(i, j)] * y[j];
      f[i] = L[packed(i, i)] * y[i];
      taken += Motion<S>{{y[i] * V[i][0], y[i] * V[i][1], y[i] * V[i][2]},
                         {y[i] * V[i][3], y[i] * V[i][4], y[i] * V[i][5]}};
    }
    return taken;
  }

  /// f = L^-T (D^-1 L^-1 b + V r) for the wrench r on the parent.
  template <int rows>
  LW_INLINE void solve_back(const Force<S>& r) {
    S x[rows];
#pragma GCC unroll 6
    for (int i = 0; i < rows; ++i)
      x[i] = f[i] + V[i][0] * r.lin.x + V[i][1] * r.lin.y + V[i][2] * r.lin.z + V[i][3] * r.ang.x +
             V[i][4] * r.ang.y + V[i][5] * r.ang.z;
#pragma GCC unroll 6
    for (int k = 0; k < rows; ++k) {
      const int i = rows - 1 - k;
#pragma GCC unroll 6
      for (int j = 0; j < rows; ++j)
        if (j > i) x[i] = x[i] - L[packed(j, i)] * x[j];
    }
#pragma GCC unroll 6
    for (int i = 0; i < rows; ++i) f[i] = x[i];
  }

 private:
  template <int rows>
  struct Factor {
    S L[21], least;
  };

  /// The twin of ldlt_factor() in linear: row by row, so that a lane register is written once.
  template <int rows>
  LW_INLINE Factor<rows> factor(const S* D) {
    Factor<rows> out;
#pragma GCC unroll 6
    for (int i = 0; i < rows; ++i) {
      S t[rows];
      S d = D[packed(i, i)];
#pragma GCC unroll 6
      for (int j = 0; j < rows; ++j) {
        if (j >= i) continue;
        t[j] = D[packed(i, j)];
#pragma GCC unroll 6
        for (int l = 0; l < rows; ++l)
          if (l < j) t[j] = t[j] - t[l] * out.L[packed(j, l)];
        out.L[packed(i, j)] = t[j] * out.L[packed(j, j)];
        d = d - t[j] * out.L[packed(i, j)];
      }
      const S margin = d - smallest_pivot * D[packed(i, i)];
      out.least = i == 0 ? margin : smaller(out.least, margin);
      out.L[packed(i, i)] = 1.0 / d;
    }
    constexpr int entries = packed(rows, 0);
#pragma GCC unroll 21
    for (int i = 0; i < entries; ++i) L[i] = out.L[i];
    return out;
  }
};

}  // namespace linkwise
