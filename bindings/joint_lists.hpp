#pragma once
// Model as Python's class, and what a joint says of itself as lists.
#include "linkwise/model/builder.hpp"
#include "linkwise/model/joint_types.hpp"
#include "numbers.hpp"
#include "py_model.hpp"

namespace linkwise::bindings {

using ModelClass = nb::class_<PyModel>;

inline nb::list axes_of(const JointSpec& joint) {
  nb::list axes;
  for (int k = 0; k < n_joint_elements(joint); ++k) {
    const JointElement element = joint_element(joint, k);
    if (element.axis < 0) continue;
    const Vec3<double>& a = joint.axes[element.axis].axis;
    axes.append(nb::make_tuple(info_of(element.kind).axis, nb::make_tuple(a.x, a.y, a.z)));
  }
  return axes;
}

/// Suffix and unit of each coordinate, and of each rate.
inline nb::tuple labels_of(const JointSpec& joint) {
  const auto list_of = [](const std::vector<ScalarLabel>& labels) {
    nb::list out;
    for (const ScalarLabel& label : labels) out.append(nb::make_tuple(label.suffix, label.unit));
    return nb::tuple(out);
  };
  return nb::make_tuple(list_of(coordinate_labels(joint)), list_of(rate_labels(joint)));
}

/// Joints that close loops; the rest of Model is in bind_model.
void bind_loop_joints(ModelClass& c);
/// What joints yield to their loads.
void bind_bearings(ModelClass& c);
/// Elastic links.
void bind_flexible(ModelClass& c, nb::class_<ModelBuilder>& builder);

}  // namespace linkwise::bindings
