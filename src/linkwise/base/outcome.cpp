#include "linkwise/base/outcome.hpp"

#include "linkwise/base/assert.hpp"

namespace linkwise {
namespace {

constexpr OutcomeEntry table[] = {
    {Outcome::converged, "converged", "it ended as asked for", ""},
    {Outcome::reached_max_iterations, "reached_max_iterations",
     "the iteration limit was reached before the tolerance was met",
     "use solver 'thomas' or 'two_level', allow more iterations, or loosen the tolerance"},
    {Outcome::not_positive_definite, "not_positive_definite", "the matrix is not positive definite",
     "check the inertias: each must be positive definite, and no two joints may constrain the same "
     "direction of the same two bodies"},
    {Outcome::not_finite, "not_finite",
     "a number in the state, the system or the iteration is not finite",
     "check masses, inertias, drives and the state for values that are infinite or far too large, "
     "and look for an unstable drive"},
    {Outcome::stagnated, "stagnated",
     "rounding errors keep the iteration from meeting the tolerance",
     "loosen the tolerance, or use the articulated_body method, which loses no digits on long "
     "straight chains"},
    {Outcome::diverged, "diverged", "the iteration diverges: its spectral radius is above 1",
     "use a solver that converges for every mechanism: 'conjugate_gradient', 'gauss_seidel' or "
     "'thomas'"},
    {Outcome::step_too_small, "step_too_small", "no step, however small, meets the tolerance",
     "look for a jump in a drive or a singular motion at this time, loosen the tolerance, or leave "
     "the integrator at auto"},
    {Outcome::too_many_steps, "too_many_steps", "the allowed number of steps is used up",
     "allow more by max_steps, loosen the tolerance, or leave the integrator at auto"},
    {Outcome::singular_position, "singular_position",
     "what closed loops demand of the accelerations contradicts itself",
     "the machine is in a singular position, such as a linkage stretched straight, or its rates "
     "open a loop: start a little beside it, with rates that keep the loops closed"},
    {Outcome::interrupted, "interrupted", "it was interrupted", "start it again"},
};

const OutcomeEntry& entry(Outcome outcome) {
  const OutcomeEntry& found = table[static_cast<int>(outcome)];
  LINKWISE_ASSERT(found.outcome == outcome, "the table follows the enumeration");
  return found;
}

}  // namespace

std::span<const OutcomeEntry> outcome_table() { return table; }
std::string_view to_string(Outcome outcome) { return entry(outcome).name; }
std::string_view message(Outcome outcome) { return entry(outcome).message; }
std::string_view remedy(Outcome outcome) { return entry(outcome).remedy; }

std::string describe(Outcome outcome) {
  std::string text(message(outcome));
  if (!remedy(outcome).empty()) text += "; " + std::string(remedy(outcome));
  return text;
}

}  // namespace linkwise
