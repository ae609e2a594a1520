#pragma once
// Frames from Python: the name of a link, or a linkwise.Frame.
#include <nanobind/nanobind.h>

#include "linkwise/model/frame.hpp"
#include "py_model.hpp"

namespace linkwise::bindings {

/// InputError where it is neither.
Frame as_frame(nanobind::handle value);

/// Model.frame_placement.
void bind_frame_placement(nanobind::class_<PyModel>& model);

/// As a person would write it: 'tool', or Frame('tool', origin=(0.1, 0, 0)).
std::string frame_text(const Frame& frame);

}  // namespace linkwise::bindings
