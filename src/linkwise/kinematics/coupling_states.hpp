#pragma once
// Couplings at a state: the sum g of polynomials p_j(q_j) less the offset is zero, and so are
//     dg/dt = sum_j p_j' u_j,     d2g/dt2 = sum_j p_j' du_j/dt + p_j'' u_j^2
#include <cmath>

#include "linkwise/kinematics/loop_states.hpp"

namespace linkwise {

/// Coordinates and rates of all joints; those of loop joints may be null where no coupling has one,
/// rates where none are asked for.
struct CoupledState {
  const double *q, *v, *loop_q, *loop_v;

  double position(const Coupling::Term& term) const { return (term.closes ? loop_q : q)[term.q]; }
  double rate(const Coupling::Term& term) const {
    const double* rates = term.closes ? loop_v : v;
    return rates ? rates[term.v] : 0;
  }
};

inline CoupledState coupled_state(const double* q, const double* v, const LoopStates& loops) {
  return {q, v, loops.q().data(), v ? loops.v().data() : nullptr};
}

struct CouplingMiss {
  double gap, slip;            ///< g and its rate
  double bend;                 ///< sum of p_j'' u_j^2
  double size = 0, speed = 0;  ///< sums of the lengths of what makes up g and its rate
};

inline CouplingMiss miss_of(const Coupling& coupling, const CoupledState& at) {
  CouplingMiss out{-coupling.offset, 0, 0, std::abs(coupling.offset)};
  for (const Coupling::Term& term : coupling.terms) {
    const double x = at.position(term), u = at.rate(term);
    const double value = term.value(x), rate = term.slope(x) * u;
    out.gap += value;
    out.slip += rate;
    out.bend += term.curvature(x) * u * u;
    out.size += std::abs(value);
    out.speed += std::abs(rate);
  }
  return out;
}

/// Whether a state has the coupling's coordinates beside its offset by no more than a millionth.
inline bool is_kept(const CouplingMiss& miss) {
  constexpr double allowed = 1e-6;
  return std::abs(miss.gap) <= allowed * (1 + miss.size);
}

/// InputError naming the first coupling that a state misses by more than a millionth. v may be
/// null; `loops`: at the same state; `where`: begins the message.
void require_coupled(const Model& model, const LoopStates& loops, const double* q, const double* v,
                     const std::string& where = "");

}  // namespace linkwise
