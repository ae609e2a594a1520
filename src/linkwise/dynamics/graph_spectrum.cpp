#include "linkwise/dynamics/graph_spectrum.hpp"

#include "linkwise/base/error.hpp"
#include "linkwise/constraint/graph_system.hpp"

namespace linkwise {

GraphSpectrum graph_spectrum(const Model& model, const double* q) {
  GraphSystem system(model);
  const std::vector<double> none(model.nv());
  SweepInput<double> in;
  in.q = q;
  in.tau = none.data();
  system.assemble(in);
  GraphSpectrum out;
  out.unknowns = system.A().size();
  KnotJacobi P;
  const int failed = P.factor(system.A());
  if (failed >= 0 || !system.is_regular())
    throw InputError(
        "spectrum" + model.where() + ": the matrix is not positive definite" +
        (failed >= 0 ? " at body '" + model.body_name(system.body_of_node(failed)) + "'" : ""));
  out.bound = P.bound(system.A());
  out.found = estimate_spectrum(system.A(), P);
  return out;
}

}  // namespace linkwise
