#pragma once
// What an evaluation tells Python: outcome, iterations, and why this method and solver.
#include <stdexcept>
#include <string>

#include "arrays.hpp"
#include "linkwise/dynamics/evaluator.hpp"

namespace linkwise::bindings {

struct NumericsError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

[[noreturn]] inline void refuse_result() {
  throw NumericsError(
      "the result is not finite; check that q, v, masses and inertias are of usual size, and "
      "that "
      "quaternions have unit length");
}

/// NumericsError unless a result holds numbers alone.
inline void check_result(const double* data, size_t n) {
  if (!all_finite({data, n})) refuse_result();
}

}  // namespace linkwise::bindings
