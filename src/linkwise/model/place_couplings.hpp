#pragma once
// Joints whose coordinates go together.
#include "linkwise/model/model.hpp"

namespace linkwise {

/// Of a model that is complete otherwise. Throws InputError where a coupling names a joint that
/// does not exist or has not one degree of freedom, names one twice, or leaves none to move.
std::vector<Coupling> place_couplings(const Model& model);

}  // namespace linkwise
