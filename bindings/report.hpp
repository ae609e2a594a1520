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

/// A report, and the name of the body at which it failed.
struct PyReport : EvaluationReport {
  std::string body_name;

  PyReport() = default;
  PyReport(const Model& model, EvaluationReport report)
      : EvaluationReport(std::move(report)), body_name(body < 0 ? "" : model.body_name(body)) {}
};

/// NumericsError unless a result holds numbers alone.
inline void check_result(const double* data, size_t n) {
  if (!is_finite(data, n))
    throw NumericsError(
        "the result is not finite; check that q, v, masses and inertias are of usual size, and "
        "that "
        "quaternions have unit length");
}

}  // namespace linkwise::bindings
