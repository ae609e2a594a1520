#pragma once
#include <nanobind/nanobind.h>

#include "linkwise/dynamics/forward_dynamics.hpp"

namespace linkwise::bindings {

/// Reads solver_options={...} into `options`; None: nothing. InputError on unknown keys, which
/// lists the known ones, and on values of the wrong kind; ranges are checked where the solver is
/// made.
void read_solver_options(nanobind::handle given, DynamicsOptions& options);

/// Do they fix the accuracy of solutions?
bool gives_tolerance(nanobind::handle given);

/// The keys with their defaults and meanings, as dictionaries.
nanobind::list solver_option_list();

}  // namespace linkwise::bindings
