#pragma once
// The named joint types: a name, and the elementary motions that the joint is a stack of.
#include <string>
#include <vector>

#include "linkwise/joints/element.hpp"
#include "linkwise/model/spec.hpp"

namespace linkwise {

/// One elementary motion of a joint, in the joint's own axes.
struct JointElement {
  ElementKind kind = ElementKind::fixed;
  int axis = -1;  ///< which axis of the joint it moves along or about, -1 where it needs none
};

struct JointTypeInfo {
  JointType type;
  const char* name;
  int n_axes;  ///< that a user must give; -1: one or more, an element each
  int n_elements;
  JointElement elements[2];  ///< inboard first
  /// What its coordinates and rates are called in results, "" where the joint's own name will do.
  const char *q_labels, *v_labels;
};

/// By JointType.
extern const JointTypeInfo joint_type_table[n_joint_types];

inline const JointTypeInfo& info_of(JointType type) {
  return joint_type_table[static_cast<int>(type)];
}

ElementKind element_kind(AxisKind kind);
inline const char* axis_kind_name(AxisKind kind) { return info_of(element_kind(kind)).axis; }

/// Element k of a joint, inboard first.
JointElement joint_element(const JointSpec& joint, int k);
int n_joint_elements(const JointSpec& joint);
/// Coordinates and rates of that element.
struct ElementSize {
  int nq, nv;
};
ElementSize element_size(const JointSpec& joint, int k);
/// Degrees of freedom.
int joint_dof(const JointSpec& joint);
/// Throws InputError with the names that are known.
JointType joint_type_from_name(const std::string& name);

inline const char* joint_type_name(JointType type) { return info_of(type).name; }

/// A coordinate or rate of a joint as results call it, and its unit; of a rate that of its
/// integral.
struct ScalarLabel {
  std::string suffix, unit;
};
std::vector<ScalarLabel> coordinate_labels(const JointSpec& joint);
std::vector<ScalarLabel> rate_labels(const JointSpec& joint);

}  // namespace linkwise
