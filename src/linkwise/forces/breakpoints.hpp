#pragma once
// Where what acts from outside changes its course: the times that an integrator must know, because
// between two of its evaluations it sees nothing.
#include <vector>

#include "linkwise/forces/table.hpp"

namespace linkwise {

/// Between two neighbouring times the input is one smooth curve, as far as an error test can tell.
struct Breakpoints {
  enum class Kind : char {
    smooth,  ///< one curve goes on through it: two neighbours must not be passed in one step
    kink,    ///< a step ends there
    jump,    ///< a step ends there, and what was before says nothing about what follows
  };
  std::vector<double> times;  ///< increasing
  std::vector<Kind> kinds;    ///< per time
};

/// How a table acts: as the sum of these multiples of its value, its first and second derivative.
struct TableAction {
  double value = 1, rate = 0, acceleration = 0;
  bool extended = false;  ///< the polynomials go on beyond the ends, instead of being held
  double floor = 0;       ///< the least scale of the integral
  double least = 0;       ///< the least scale of the action itself
};

/// The times at which the action of a table changes its course: rows where it jumps or has a kink,
/// and its ends. Rows that merely sample a smooth curve do not count. What tells them apart is the
/// integral of the action, which is what changes velocities: between two breakpoints one polynomial
/// of degree 4 follows it to `tolerance` times its scale (docs/theory/integrate.md).
Breakpoints find_breakpoints(const Table& table, const TableAction& action, double tolerance);

}  // namespace linkwise
