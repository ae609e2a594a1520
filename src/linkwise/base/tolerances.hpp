#pragma once
// The two numbers by which the sweeps and systems judge their rounding errors.

namespace linkwise {

/// A pivot is positive when it is more than this part of the diagonal entry that it came from. Two
/// columns that move a body alike leave rounding noise below it, not zero.
inline constexpr double smallest_pivot = 1e-13;

/// Accelerations are refined if they miss their equations by more than this part of the largest
/// one.
inline constexpr double acceptable_violation = 1e-12;

}  // namespace linkwise
