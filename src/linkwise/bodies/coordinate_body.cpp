#include "linkwise/bodies/coordinate_body.hpp"

#include "linkwise/bodies/body_kinds.hpp"
#include "linkwise/simd/lanes.hpp"

namespace linkwise {
namespace {

/// f(the body, as of its kind), where that has coordinates.
template <class F>
void with_kind(BodyKind kind, const void* body, F&& f) {
  BodyKinds::dispatch(kind, [&](auto tag) {
    using B = typename decltype(tag)::Body;
    if constexpr (has_coordinates<B>) f(*static_cast<const B*>(body));
  });
}

}  // namespace

int CoordinateBody::n_coordinates() const {
  int n = 0;
  with_kind(kind_, body_, [&](const auto& body) { n = body.n_coordinates(); });
  return n;
}

RigidBody<double> CoordinateBody::resting() const {
  RigidBody<double> out{};
  with_kind(kind_, body_, [&](const auto& body) { out.inertia = frozen_inertia(body); });
  return out;
}

template <class S>
void CoordinateBody::calc(const Motion<S>& v, const OwnState<S>& own, OwnEquations<S>& out) const {
  with_kind(kind_, body_, [&](const auto& body) { calc_equations(body, v, own, out); });
}

#define LW_CALC(S) \
  template void CoordinateBody::calc(const Motion<S>&, const OwnState<S>&, OwnEquations<S>&) const;
LW_CALC(double)
LW_CALC(Lanes<2>)
LW_CALC(Lanes<4>)
LW_CALC(Lanes<8>)
#undef LW_CALC

}  // namespace linkwise
