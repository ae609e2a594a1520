#pragma once
// Bodies in which something moves: coordinates of their own, beside those of joints. Their
// equations of motion are
//     [ M     M_e ] [ a  ]   [ p   ]   [ wrench on port 0 ]
//     [ M_e^T m_e ] [ du ] + [ p_e ] = [ tau              ]
// with a the acceleration of the body's frame, du those of the coordinates, and p, p_e what both
// take without acceleration. A kind answers these blocks; everything else is made of them. Joints
// on a port that the coordinates move add to all four of them (elastic_port.hpp).
//
// Sweeps eliminate du (recursion/own_steps.hpp), so that the joint inboard sees six equations:
//     (M - M_e m_e^-1 M_e^T) a + p + M_e m_e^-1 (tau - p_e) = wrench on port 0.
#include <concepts>
#include <span>

#include "linkwise/spatial/elastic_port.hpp"
#include "linkwise/spatial/inertia.hpp"

namespace linkwise {

/// Of one body: its coordinates, their rates and the forces on them. Rates are null at rest, forces
/// where there are none.
template <class S>
struct OwnState {
  const S *q, *v, *tau;
  S rate(int k) const { return v ? v[k] : S{}; }
  S force(int k) const { return tau ? tau[k] : S{}; }
};

/// The blocks of the equations of motion of a body with n coordinates.
template <class S>
struct OwnEquations {
  ArticulatedInertia<S> M;
  Force<S> p;
  Force<S>* M_e;  ///< [n] columns
  S* m_e;         ///< packed lower triangle
  S* p_e;         ///< [n]
};

/// The same with room for what it points to.
template <class S>
struct OwnEquationsHere : OwnEquations<S> {
  OwnEquationsHere() : OwnEquations<S>{{}, {}, columns.at, square, bias} {}
  OwnEquationsHere(const OwnEquationsHere&) = delete;
  OwnEquationsHere& operator=(const OwnEquationsHere&) = delete;

 private:
  PerCoordinate<Force<S>> columns;
  S square[most_coordinates * (most_coordinates + 1) / 2];
  S bias[most_coordinates];
};

template <class B>
inline constexpr bool has_coordinates = B::with_coordinates;

/// What a kind with coordinates answers beside the functions of every kind (body_kinds.hpp), which
/// then speak of a body whose coordinates are zero and rest.
template <class B>
concept AnswersForCoordinates = requires(const B& body, const Motion<double>& v,
                                         const OwnState<double>& own, OwnEquations<double>& out) {
  { body.n_coordinates() } -> std::convertible_to<int>;  // most_coordinates at most
  { body.stiffness(0) } -> std::convertible_to<double>;
  { body.damping(0) } -> std::convertible_to<double>;
  // Of a body of these parameters that carries joints on a port, 0: it carries none there.
  { B::port_coordinates(std::span<const double>()) } -> std::same_as<int>;
  // That port, null: it has none.
  { body.port() } -> std::convertible_to<const ElasticShape*>;
  // Body's frame -> the one that the port's shape starts from.
  { body.to_port_base() } -> std::convertible_to<Transform<double>>;
  // Writes all of the blocks; a template on the scalar of the motion.
  {calc_equations(body, v, own, out)};
};

// What else is asked of such a body, from its blocks.

/// f(k, m_e's row k times x).
template <class S, class F>
LW_INLINE void times_own(int n, const S* m_e, const S* x, F&& f) {
  for (int i = 0; i < n; ++i) {
    S sum{};
    for (int j = 0; j < n; ++j) sum += m_e[i >= j ? packed(i, j) : packed(j, i)] * x[j];
    f(i, sum);
  }
}

/// What both sides of the equations take: adds M a + M_e du + p to the wrench, and writes
/// M_e^T a + m_e du + p_e unless tau is null. du null: zero.
template <class S>
void add_own_load(int n, const OwnEquations<S>& of, const Motion<S>& a, const S* du, Force<S>& w,
                  S* tau) {
  w += of.M * a;
  w += of.p;
  for (int k = 0; k < n; ++k) {
    if (du) w += du[k] * of.M_e[k];
    if (tau) tau[k] = of.p_e[k] + dot(a, of.M_e[k]);
  }
  if (tau && du) times_own(n, of.m_e, du, [&](int k, const S& x) { tau[k] += x; });
}

/// The frame's own part of it, to be known before accelerations are.
template <class B, class S>
Force<S> momentum_bias(const B& body, const Motion<S>& v, const OwnState<S>& own) {
  OwnEquationsHere<S> of;
  calc_equations(body, v, own, of);
  return of.p;
}

template <class B>
Force<double> momentum(const B& body, const Motion<double>& v, const OwnState<double>& own) {
  OwnEquationsHere<double> of;
  calc_equations(body, v, own, of);
  Force<double> h = of.M * v;
  for (int k = 0; k < body.n_coordinates(); ++k) h += own.rate(k) * of.M_e[k];
  return h;
}

template <class B>
double kinetic_energy(const B& body, const Motion<double>& v, const OwnState<double>& own) {
  OwnEquationsHere<double> of;
  calc_equations(body, v, own, of);
  double twice = dot(v, of.M * v);
  if (!own.v) return 0.5 * twice;
  for (int k = 0; k < body.n_coordinates(); ++k) twice += 2 * own.v[k] * dot(v, of.M_e[k]);
  times_own(body.n_coordinates(), of.m_e, own.v, [&](int k, double x) { twice += own.v[k] * x; });
  return 0.5 * twice;
}

/// In uniform gravity g of a body whose frame is X from the world's: -g . (m r + R^T m c), where m
/// and m c are those of M.
template <class B>
double potential_energy(const B& body, const Transform<double>& X, const Vec3<double>& g,
                        const OwnState<double>& own) {
  OwnEquationsHere<double> of;
  calc_equations(body, Motion<double>{}, own, of);
  const Vec3<double> mc{of.M.B.m[5], of.M.B.m[6], of.M.B.m[1]};
  return -dot(g, of.M.A.m[0] * X.r + transpose_times(X.R, mc));
}

}  // namespace linkwise
