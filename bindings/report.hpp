#pragma once
// What an evaluation tells Python: outcome, iterations, and why this method and solver.
#include <stdexcept>
#include <string>

#include "linkwise/dynamics/forward_dynamics.hpp"

namespace linkwise::bindings {

struct NumericsError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct PyReport {
  std::string outcome = "converged", method, solver, reason, body;
  int iterations = 0;
  double error_estimate = 0;
};

/// One line: what happened, where, and the remedy.
inline std::string failure_text(const Model& m, const PyReport& report, Outcome outcome) {
  return "method " + report.method +
         (report.solver.empty() ? "" : " with solver " + report.solver) + ": " +
         std::string(message(outcome)) +
         (report.body.empty() ? "" : " at body '" + report.body + "'" + m.where()) + "; " +
         std::string(remedy(outcome));
}

}  // namespace linkwise::bindings
