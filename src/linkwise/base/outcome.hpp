#pragma once
// How a computation ended: one list of words for solvers, methods, integrators and simulations, so
// that the same failure has the same name and the same remedy wherever it shows.
#include <span>
#include <string>
#include <string_view>

namespace linkwise {

enum class Outcome {
  converged,  ///< as asked for: solved to the tolerance, or simulated to the end
  reached_max_iterations,
  not_positive_definite,
  not_finite,
  stagnated,
  diverged,
  step_too_small,
  too_many_steps,
  singular_position,
  interrupted,
};

struct OutcomeEntry {
  Outcome outcome;
  std::string_view name;
  std::string_view message;  ///< what happened, one clause
  std::string_view remedy;   ///< what the user can do about it; empty for `converged`
};

/// Every outcome, in the order of the enumeration.
std::span<const OutcomeEntry> outcome_table();

std::string_view to_string(Outcome outcome);
std::string_view message(Outcome outcome);
std::string_view remedy(Outcome outcome);

/// Message and remedy in one line.
std::string describe(Outcome outcome);

/// How a simulation, or one member of several, ended.
struct Ending {
  Outcome outcome = Outcome::converged;
  double time = 0;    ///< of the evaluation that failed, else the last one reached
  std::string joint;  ///< where it failed, where that is known
  std::string text;   ///< one line with the remedy; empty for `converged`

  bool ok() const { return outcome == Outcome::converged; }
};

}  // namespace linkwise
