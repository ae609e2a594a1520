#pragma once
// Bodies in which something moves: coordinates of their own, beside those of joints. Their
// equations of motion are
//     [ M     M_e ] [ a  ]   [ p   ]   [ wrench on port 0 ]
//     [ M_e^T m_e ] [ du ] + [ p_e ] = [ tau              ]
// with a the acceleration of the body's frame, du those of the coordinates, and p, p_e what both
// take without acceleration. A kind eliminates du itself, so that a sweep sees six equations:
//     (M - M_e m_e^-1 M_e^T) a + p - M_e m_e^-1 (p_e - tau) = wrench on port 0.
#include <concepts>

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

/// A body whose own coordinates are eliminated: M a + p is the wrench that an acceleration takes.
template <class S>
struct Condensed {
  ArticulatedInertia<S> M;
  Force<S> p;
};

template <class B>
inline constexpr bool has_coordinates = B::n_coordinates > 0;

/// What a kind with coordinates answers beside the functions of every kind (body_kinds.hpp), which
/// then speak of a body whose coordinates are zero and rest. Templates on the scalar of the motion,
/// but for energies.
template <class B>
concept AnswersForCoordinates = requires(const B& body, const Motion<double>& v,
                                         const Transform<double>& X, const Vec3<double>& g,
                                         const OwnState<double>& own, const double* rates,
                                         Force<double>& wrench, double* out) {
  { body.stiffness(0) } -> std::convertible_to<double>;
  { body.damping(0) } -> std::convertible_to<double>;
  { condense(body, v, own) } -> std::same_as<Condensed<double>>;
  // du where the body's frame has an acceleration
  {accelerate_own(body, v, own, v, out)};
  { momentum_bias(body, v, own) } -> std::same_as<Force<double>>;
  // adds M a + M_e du to the wrench, writes M_e^T a + m_e du + p_e; du null: zero, out null: no
  {add_own_load(body, v, own, v, rates, wrench, out)};
  { momentum(body, v, own) } -> std::same_as<Force<double>>;
  { kinetic_energy(body, v, own) } -> std::same_as<double>;
  { potential_energy(body, X, g, own) } -> std::same_as<double>;
};

}  // namespace linkwise
