#include "linkwise/kinematics/coupling_states.hpp"

#include <iomanip>
#include <sstream>

#include "linkwise/base/error.hpp"

namespace linkwise {
namespace {

/// To three digits.
std::string rounded(double x) {
  std::ostringstream text;
  text << std::setprecision(3) << x;
  return text.str();
}

}  // namespace

void require_coupled(const Model& model, const LoopStates& loops, const double* q, const double* v,
                     const std::string& where) {
  constexpr double allowed = 1e-6;
  for (const Coupling& coupling : model.couplings) {
    const CouplingMiss miss = miss_of(coupling, coupled_state(q, v, loops));
    const auto name = [&] { return where + "coupling '" + coupling.name + "'" + model.where(); };
    if (!is_kept(miss))
      throw InputError(name() + ": its coordinates add up to " + rounded(miss.gap) +
                       " beside its offset; give q that keeps it");
    if (!(std::abs(miss.slip) <= allowed * (1 + miss.speed)))
      throw InputError(name() + ": its rates add up to " + rounded(miss.slip) +
                       "; give v that keeps it");
  }
}

}  // namespace linkwise
