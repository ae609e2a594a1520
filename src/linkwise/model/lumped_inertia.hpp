#pragma once
// Links that are welded together as one inertia.
#include <vector>

#include "linkwise/model/machine.hpp"
#include "linkwise/model/model.hpp"

namespace linkwise {

struct LumpedInertia {
  std::vector<Transform<double>> from_lead;  ///< by link: its lead's frame -> its frame
  std::vector<Inertia<double>> inertia;      ///< by lead, in its frame
  double moving_mass = 0;
};

/// Sums the inertias of the links of each lump and notes what was welded. Throws InputError where a
/// sum is an inertia that no body has, or where a joint can move a lump without mass that is a
/// leaf.
LumpedInertia lump_inertia(const Machine& machine, const Lumps& lumps, std::vector<Note>& notes);

/// Singular as a 6x6 matrix: no mass, or no rotational inertia about some axis through the centre.
bool is_singular(const Inertia<double>& M);

}  // namespace linkwise
