#pragma once
// What conjugate gradients meet on a machine with loops or elastic bodies at one state.
#include "linkwise/dynamics/evaluator.hpp"
#include "linkwise/solve/iterative/knot_jacobi.hpp"
#include "linkwise/solve/spectrum.hpp"

namespace linkwise {

struct GraphSpectrum {
  int unknowns = 0;
  Spectrum found;           ///< of P^-1 A
  KnotJacobi::Bound bound;  ///< what the bodies one by one say of it
};

/// At rest at q [nq]. InputError: what GraphSystem refuses, or a matrix that is not positive
/// definite.
GraphSpectrum graph_spectrum(const Model& model, const double* q);

}  // namespace linkwise
