#pragma once
// A frame that an elastic body carries. Coordinates eta of the body place it, seen from the body's
// frame, at
//     r = r0 + Phi eta + 1/2 eta^T G eta,   turned by exp(theta~),  theta = Psi eta
// Its motion is v_port = X v + P xi with
//     P = [R (Phi + G eta); T(theta) Psi],
// T being the exact tangent of the exponential map [simo1988]: with a linearised one a bent body
// would gain or lose energy.
#include <array>
#include <vector>

#include "linkwise/spatial/motion.hpp"

namespace linkwise {

/// Coordinates that a body can have of its own, at most.
inline constexpr int most_coordinates = 40;

/// Room for one of them each. It is not set: most bodies have few.
template <class T>
struct PerCoordinate {
  union {
    T at[most_coordinates];
  };
  PerCoordinate() {}
  LW_INLINE operator T*() { return at; }
  LW_INLINE operator const T*() const { return at; }
};

/// What places the frame; constants of the body.
struct ElasticShape {
  int n = 0;                      ///< coordinates
  Vec3<double> rest;              ///< r0, m
  std::vector<Vec3<double>> Phi;  ///< [n]
  std::vector<Vec3<double>> Psi;  ///< [n]
  /// G of x, y, z as packed lower triangles; empty: zero.
  std::array<std::vector<double>, 3> G;
};

/// Power series of sin s / s, (1 - cos s) / s^2 and (s - sin s) / s^3 in s^2, and the slopes of the
/// last two. To rounding for half a turn: no branch, so lanes share it. A port that turns as far is
/// no longer described by its body's coordinates anyway.
struct TurnTerms {
  static constexpr int n = 13;
  double sine[n], versine[n], rest[n];  ///< signed
  constexpr TurnTerms() : sine{}, versine{}, rest{} {
    double factorial = 1;  // (2 i + 1)!
    for (int i = 0; i < n; ++i) {
      if (i > 0) factorial *= (2.0 * i) * (2.0 * i + 1);
      const double sign = i % 2 ? -1 : 1, more = factorial * (2.0 * i + 2);
      sine[i] = sign / factorial;
      versine[i] = sign / more;
      rest[i] = sign / (more * (2.0 * i + 3));
    }
  }
};
inline constexpr TurnTerms turn_terms;

template <class S>
struct TurnSeries {
  S sine{}, versine{}, rest{}, d_versine{}, d_rest{};

  TurnSeries() = default;
  explicit TurnSeries(const S& square) {
#pragma GCC unroll 13
    for (int i = TurnTerms::n - 1; i >= 0; --i) {
      d_versine = d_versine * square + versine;
      d_rest = d_rest * square + rest;
      sine = sine * square + turn_terms.sine[i];
      versine = versine * square + turn_terms.versine[i];
      rest = rest * square + turn_terms.rest[i];
    }
  }
};

/// The frame at one instant: where it is from the body's, and the columns of its motion.
template <class S>
struct ElasticPort {
  Transform<S> X;
  PerCoordinate<Motion<S>> P;
  Vec3<S> theta;
  TurnSeries<S> turn;  ///< of theta
};

namespace elastic_port {

template <class S>
LW_INLINE Vec3<S> theta(const ElasticShape& shape, const S* eta) {
  Vec3<S> out;
  for (int k = 0; k < shape.n; ++k) out += eta[k] * shape.Psi[k];
  return out;
}

/// a^T G b of one component.
template <class S>
LW_INLINE S form(int n, const std::vector<double>& G, const S* a, const S* b) {
  S sum{};
  if (G.empty()) return sum;
  for (int i = 0; i < n; ++i) {
    S row{};
    for (int j = 0; j < n; ++j) row += G[i >= j ? packed(i, j) : packed(j, i)] * b[j];
    sum += a[i] * row;
  }
  return sum;
}
template <class S>
LW_INLINE Vec3<S> form(const ElasticShape& shape, const S* a, const S* b) {
  return {form(shape.n, shape.G[0], a, b), form(shape.n, shape.G[1], a, b),
          form(shape.n, shape.G[2], a, b)};
}

/// Components along the body's axes -> along the port's: 1 - sine theta~ + versine theta~^2.
template <class S>
LW_INLINE Mat3<S> rotation(const Vec3<S>& t, const TurnSeries<S>& of) {
  const S xx = t.x * t.x, yy = t.y * t.y, zz = t.z * t.z, v = of.versine, s = of.sine;
  return {{1.0 - v * (yy + zz), v * t.x * t.y + s * t.z, v * t.x * t.z - s * t.y,
           v * t.x * t.y - s * t.z, 1.0 - v * (xx + zz), v * t.y * t.z + s * t.x,
           v * t.x * t.z + s * t.y, v * t.y * t.z - s * t.x, 1.0 - v * (xx + yy)}};
}

template <class S>
LW_INLINE Transform<S> pose(const ElasticShape& shape, const S* eta, const Vec3<S>& t,
                            const TurnSeries<S>& of) {
  Vec3<S> r = 0.5 * form(shape, eta, eta);
  r += shape.rest;
  for (int k = 0; k < shape.n; ++k) r += eta[k] * shape.Phi[k];
  return {rotation(t, of), r};
}

}  // namespace elastic_port

template <class S>
LW_INLINE Transform<S> elastic_pose(const ElasticShape& shape, const S* eta) {
  const Vec3<S> t = elastic_port::theta(shape, eta);
  return elastic_port::pose(shape, eta, t, TurnSeries<S>(dot(t, t)));
}

template <class S>
LW_INLINE void calc_elastic_port(const ElasticShape& shape, const S* eta, ElasticPort<S>& out) {
  out.theta = elastic_port::theta(shape, eta);
  out.turn = TurnSeries<S>(dot(out.theta, out.theta));
  const Vec3<S>& t = out.theta;
  const TurnSeries<S>& of = out.turn;
  out.X = elastic_port::pose(shape, eta, t, of);
  for (int k = 0; k < shape.n; ++k) {
    Vec3<S> B{shape.Phi[k].x + S{}, shape.Phi[k].y + S{}, shape.Phi[k].z + S{}};
    S* const parts[] = {&B.x, &B.y, &B.z};
    for (int i = 0; i < 3; ++i) {
      const std::vector<double>& G = shape.G[i];
      if (G.empty()) continue;
      for (int j = 0; j < shape.n; ++j)
        *parts[i] += G[k >= j ? packed(k, j) : packed(j, k)] * eta[j];
    }
    const Vec3<S> Psi{shape.Psi[k].x + S{}, shape.Psi[k].y + S{}, shape.Psi[k].z + S{}};
    const Vec3<S> once = cross(t, Psi);
    out.P[k].lin = out.X.R * B;
    out.P[k].ang = Psi - of.versine * once + of.rest * cross(t, once);
  }
}

/// The rate of P times xi. P xi is the port's motion against the body.
template <class S>
LW_INLINE Motion<S> elastic_column_rate(const ElasticShape& shape, const ElasticPort<S>& port,
                                        const S* xi, const Motion<S>& relative) {
  const Vec3<S>& t = port.theta;
  const Vec3<S> dt = elastic_port::theta(shape, xi);
  const TurnSeries<S>& of = port.turn;
  const S d_square = 2.0 * dot(t, dt);
  const Vec3<S> once = cross(t, dt);
  return {port.X.R * elastic_port::form(shape, xi, xi) - cross(relative.ang, relative.lin),
          (d_square * of.d_rest) * cross(t, once) - (d_square * of.d_versine) * once +
              of.rest * cross(dt, once)};
}

}  // namespace linkwise
