#pragma once
// A body of any kind with coordinates of its own. Sweeps see this one type, so that they are
// compiled once for all such kinds; which kind it is, is asked once per body and call.
#include <cstdint>

#include "linkwise/bodies/own_coordinates.hpp"
#include "linkwise/bodies/rigid.hpp"

namespace linkwise {

enum class BodyKind : std::uint8_t;

class CoordinateBody {
 public:
  static constexpr bool with_coordinates = true;

  CoordinateBody() = default;
  /// Of a body that is kept elsewhere.
  CoordinateBody(BodyKind kind, const void* body) : kind_(kind), body_(body) {}

  int n_coordinates() const;
  /// With coordinates at zero.
  RigidBody<double> resting() const;
  /// All blocks of its equations of motion, for double and for lanes of 2, 4 and 8.
  template <class S>
  void calc(const Motion<S>& v, const OwnState<S>& own, OwnEquations<S>& out) const;

 private:
  BodyKind kind_{};
  const void* body_ = nullptr;
};

template <class S>
void calc_equations(const CoordinateBody& body, const Motion<S>& v, const OwnState<S>& own,
                    OwnEquations<S>& out) {
  body.calc(v, own, out);
}

// With coordinates at zero and resting, it is a rigid body.
inline double mass(const CoordinateBody& body) { return mass(body.resting()); }
template <class S>
Force<S> inertia_times(const CoordinateBody& body, const Motion<S>& a) {
  return inertia_times(body.resting(), a);
}
template <class S>
Force<S> momentum(const CoordinateBody& body, const Motion<S>& v) {
  return momentum(body.resting(), v);
}
template <class S>
Force<S> momentum_bias(const CoordinateBody& body, const Motion<S>& v) {
  return momentum_bias(body.resting(), v);
}
template <class S>
void add_inertia(ArticulatedInertia<S>& Y, const CoordinateBody& body) {
  add_inertia(Y, body.resting());
}
inline Inertia<double> frozen_inertia(const CoordinateBody& body) { return body.resting().inertia; }
inline Compliance<double> compliance(const CoordinateBody& body) {
  return compliance(body.resting());
}
template <class From>
Matrix6<double> compliance(const CoordinateBody& body, const From& from,
                           const Transform<double>& X) {
  return compliance(body.resting(), from, X);
}

}  // namespace linkwise
