#pragma once
#include <nanobind/nanobind.h>

#include "linkwise/solve/solver.hpp"

namespace linkwise::bindings {

/// What solver_options={...} says; None: nothing. InputError on unknown keys, which lists the known
/// ones, and on values of the wrong kind.
SolverOptionValues solver_option_values(nanobind::handle given);

/// The keys with their defaults and meanings, as dictionaries.
nanobind::list solver_option_list();

}  // namespace linkwise::bindings
