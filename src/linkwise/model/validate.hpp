#pragma once
// Checks of single links and joints, before anything is built. Every message is one line: element,
// file, remedy.
#include <array>
#include <string>
#include <vector>

#include "linkwise/model/spec.hpp"

namespace linkwise {

/// validate_link and validate_joint on everything in the spec. Throws InputError where there are no
/// links or gravity is not finite.
void validate(ModelSpec& spec, std::vector<Note>& notes);

/// Whether ascending principal moments are negative beyond the rounding of printed numbers.
bool clearly_negative(double mass, const double principal[3]);

/// Throws InputError on non-finite numbers or a negative mass; adds a warning note on a broken
/// triangle inequality or a vanishing principal inertia. Negative inertias are judged later, once
/// the welded links are summed.
void validate_link(const LinkSpec& link, const std::string& where, std::vector<Note>& notes);

/// Throws InputError, which begins with `what`, unless the matrix is orthonormal and right-handed.
void require_rotation(const Mat3<double>& R, const std::string& what);

/// Throws InputError on non-finite numbers, a placement that is no rotation, or a zero or missing
/// axis; normalises the axes.
void validate_joint(JointSpec& joint, const std::string& where);

/// Adds a warning note on each property that does nothing because another one is missing.
void note_idle(const JointSpec& joint, std::vector<Note>& notes);
/// The same of the limits of a spring between two points, which are for its stops alone.
void note_idle_limits(const JointSpec& spring, std::vector<Note>& notes);

/// Appends the joint's properties, one value per degree of freedom, to the model's arrays. Throws
/// InputError on values of the wrong number or sign, or limits that are swapped.
void append_dof_properties(const JointSpec& joint, const std::string& where,
                           std::array<std::vector<double>, n_dof_properties>& dof);

/// A number as messages print it: -0.01, not -0.010000.
std::string number_text(double value);

/// Principal moments, ascending.
void principal_moments(const Sym3<double>& I, double out[3]);

/// "; did you mean 'elbow'?" for the nearest of the known names, or a list of some of them.
std::string suggest(const std::string& name, const std::vector<std::string>& known);

}  // namespace linkwise
