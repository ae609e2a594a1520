#pragma once
// What a joint's motion subspace P leaves: the orthonormal complement, whose columns are the
// directions that the joint holds, and the dual P^+T, which reads rates off a motion.
#include <algorithm>
#include <cmath>

#include "linkwise/spatial/matrix6.hpp"

namespace linkwise {

/// Complement by Householder reflections of the columns of P; n <= 6 of full rank.
inline void householder_complement(const Motion<double>* P, int n, Vector6<double>* dual,
                                   Vector6<double>* complement) {
  double A[6][6];  // A[j] = column j
  for (int j = 0; j < n; ++j) {
    const Vector6<double> column = to_array(P[j]);
    for (int i = 0; i < 6; ++i) A[j][i] = column[i];
  }
  double v[6][6], R[6][6] = {};
  for (int j = 0; j < n; ++j) {
    double norm = 0;
    for (int i = j; i < 6; ++i) norm += A[j][i] * A[j][i];
    norm = std::sqrt(norm);
    const double alpha = A[j][j] > 0 ? -norm : norm;
    double length = 0;
    for (int i = 0; i < 6; ++i) {
      v[j][i] = i < j ? 0 : A[j][i] - (i == j ? alpha : 0);
      length += v[j][i] * v[j][i];
    }
    const double k = length > 0 ? 2 / length : 0;
    for (int i = 0; i < 6; ++i) v[j][i] *= std::sqrt(k);
    for (int c = j; c < n; ++c) {
      double s = 0;
      for (int i = j; i < 6; ++i) s += v[j][i] * A[c][i];
      for (int i = j; i < 6; ++i) A[c][i] -= s * v[j][i];
    }
    for (int c = j; c < n; ++c) R[j][c] = A[c][j];
  }
  Vector6<double> Q[6];  // columns of the orthogonal factor
  for (int c = 0; c < 6; ++c) {
    for (int i = 0; i < 6; ++i) Q[c][i] = i == c;
    for (int j = n - 1; j >= 0; --j) {
      double s = 0;
      for (int i = 0; i < 6; ++i) s += v[j][i] * Q[c][i];
      for (int i = 0; i < 6; ++i) Q[c][i] -= s * v[j][i];
    }
  }
  // P^+T = Q1 R^-T: column by column of P^+T R^T = Q1, from the last.
  for (int c = n - 1; c >= 0; --c) {
    dual[c] = Q[c];
    for (int l = c + 1; l < n; ++l)
      for (int i = 0; i < 6; ++i) dual[c][i] -= R[c][l] * dual[l][i];
    for (int i = 0; i < 6; ++i) dual[c][i] /= R[c][c];
  }
  for (int c = n; c < 6; ++c) complement[c - n] = Q[c];
}

/// Complement and dual of directions p[0..n) of three-space, n <= 3 of full rank. Two of them have
/// the normal of their plane as complement, three nothing: smooth in p, whatever its sign.
inline void complement_of_directions(const Vec3<double>* p, int n, Vec3<double>* dual,
                                     Vec3<double>* complement) {
  const Vec3<double> unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  if (n == 0) {
    std::copy(unit, unit + 3, complement);
  } else if (n == 1) {
    // The coordinate axes next to the largest component, made orthogonal to p.
    const double size[3] = {std::abs(p[0].x), std::abs(p[0].y), std::abs(p[0].z)};
    const int k = size[2] >= size[0] && size[2] >= size[1] ? 2 : size[1] >= size[0] ? 1 : 0;
    const double square = dot(p[0], p[0]);
    dual[0] = (1 / square) * p[0];
    const Vec3<double> first = unit[(k + 1) % 3] - dot(unit[(k + 1) % 3], dual[0]) * p[0];
    complement[0] = (1 / std::sqrt(dot(first, first))) * first;
    complement[1] = (1 / std::sqrt(square)) * cross(p[0], complement[0]);
  } else {
    Vec3<double> normal = cross(p[0], p[1]);
    if (n == 2) complement[0] = (1 / std::sqrt(dot(normal, normal))) * normal;
    const Vec3<double> third = n == 3 ? p[2] : normal;
    const double volume = dot(normal, third);
    dual[0] = (1 / volume) * cross(p[1], third);
    dual[1] = (1 / volume) * cross(third, p[0]);
    if (n == 3) dual[2] = (1 / volume) * normal;
  }
}

/// Complement and dual if every column is a pure translation or a pure rotation; false otherwise.
/// Forces and moments stay apart, and the columns vary smoothly with the joint. That matters for
/// the paper's guess, a polynomial in time through the last forces: it is useless if the directions
/// of the forces turn, or if forces in the plane of a motion mix with moments out of it.
inline bool separate_complement(const Motion<double>* P, int n, Vector6<double>* dual,
                                Vector6<double>* complement) {
  Vec3<double> axes[2][3], duals[2][3], complements[2][3];
  int count[2] = {0, 0}, kind[6], place[6];
  for (int j = 0; j < n; ++j) {
    const bool turns = dot(P[j].ang, P[j].ang) > 0, slides = dot(P[j].lin, P[j].lin) > 0;
    if (turns == slides || count[turns] == 3) return false;
    kind[j] = turns;
    place[j] = count[turns];
    axes[turns][count[turns]++] = turns ? P[j].ang : P[j].lin;
  }
  int columns = 0;
  for (int k = 0; k < 2; ++k) {
    complement_of_directions(axes[k], count[k], duals[k], complements[k]);
    for (int i = 0; i < 3 - count[k]; ++i) {
      const Vec3<double>& c = complements[k][i];
      complement[columns++] = k == 0 ? Vector6<double>{c.x, c.y, c.z, 0, 0, 0}
                                     : Vector6<double>{0, 0, 0, c.x, c.y, c.z};
    }
  }
  for (int j = 0; j < n; ++j) {
    const Vec3<double>& d = duals[kind[j]][place[j]];
    dual[j] = kind[j] == 0 ? Vector6<double>{d.x, d.y, d.z, 0, 0, 0}
                           : Vector6<double>{0, 0, 0, d.x, d.y, d.z};
  }
  return true;
}

/// Complement and dual of a single screw, whose translation is along its axis. Forces and moments
/// stay apart as in separate_complement(), except for the wrench along the axis that does no work.
inline bool screw_complement(const Motion<double>* P, int n, Vector6<double>* dual,
                             Vector6<double>* complement) {
  if (n != 1) return false;
  const Vec3<double>&slide = P->lin, &turn = P->ang, off = cross(slide, turn);
  if (dot(off, off) > 0) return false;
  const double square = dot(slide, slide) + dot(turn, turn), size = std::sqrt(square);
  dual[0] = to_array(Motion<double>{(1 / square) * slide, (1 / square) * turn});
  Vec3<double> unused, across[2];
  complement_of_directions(&turn, 1, &unused, across);
  for (int i = 0; i < 2; ++i) {
    complement[i] = to_array(Force<double>{across[i], {}});
    complement[3 + i] = to_array(Force<double>{{}, across[i]});
  }
  complement[2] = to_array(Force<double>{(1 / size) * turn, (-1 / size) * slide});
  return true;
}

/// Whether a dual is so long that rounding alone has made it: the columns of P are dependent, as
/// those of hinges that line up are, and nothing says how the motion is shared among them.
inline bool are_dependent(const Motion<double>* P, int n, const Vector6<double>* dual) {
  constexpr double longest = 1e14;
  for (int i = 0; i < n; ++i) {
    double square = 0;
    for (double x : dual[i]) square += x * x;
    const double length = square * (dot(P[i].lin, P[i].lin) + dot(P[i].ang, P[i].ang));
    if (!(length < longest * longest)) return true;
  }
  return false;
}

/// dual [n] and complement [6 - n] of columns P, by the way that suits them.
inline void calc_complement(const Motion<double>* P, int n, Vector6<double>* dual,
                            Vector6<double>* complement) {
  if (!separate_complement(P, n, dual, complement) && !screw_complement(P, n, dual, complement))
    householder_complement(P, n, dual, complement);
}

}  // namespace linkwise
