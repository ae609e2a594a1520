#pragma once
#include <nanobind/nanobind.h>

#include "linkwise/model/builder.hpp"

namespace linkwise::bindings {

nanobind::class_<ModelBuilder> bind_builder(nanobind::module_& m);
void bind_frame(nanobind::module_& m);
void bind_model(nanobind::module_& m, nanobind::class_<ModelBuilder>& builder);
void bind_dynamics(nanobind::module_& m);
void bind_inverse(nanobind::module_& m);
void bind_causes(nanobind::module_& m);
void bind_indeterminacy(nanobind::module_& m);
void bind_loop_gaps(nanobind::module_& m);
void bind_kinematics(nanobind::module_& m);
void bind_sections(nanobind::module_& m);
void bind_simulation(nanobind::module_& m);
void bind_batch_simulation(nanobind::module_& m);
void bind_solve(nanobind::module_& m);
void bind_paper(nanobind::module_& m);
/// Of all functions that were bound.
void tell_wrong_arguments_on_one_line(nanobind::module_& m);

}  // namespace linkwise::bindings
