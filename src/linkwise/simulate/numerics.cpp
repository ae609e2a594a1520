#include "linkwise/simulate/numerics.hpp"

#include <cmath>

#include "linkwise/base/error.hpp"
#include "linkwise/base/named.hpp"

namespace linkwise {
namespace {

constexpr NumericsEntry table[] = {
    {"tolerance", &Numerics::tolerance,
     "accuracy to aim at, relative to the size of the state and absolute"},
    {"step_tolerance", &Numerics::step_tolerance,
     "error allowed in one step, in the same measure; a tenth of tolerance by default, which it "
     "replaces where given"},
    {"integrator", &Numerics::integrator, "one of linkwise.integrators()"},
    {"step", &Numerics::step, "step of the fixed-step integrators", "s"},
    {"max_step", &Numerics::max_step,
     "longest step of the others; what acts by the clock is seen without it", "s"},
    {"max_steps", &Numerics::max_steps, "most steps of the whole run; no bound by default"},
    {"method", &Numerics::method,
     "how accelerations are computed: auto, or one of linkwise.methods()"},
    {"solver", &Numerics::solver,
     "linear solver of the constraint-force method: auto, or one of linkwise.solvers()"},
    {"initial_guess", &Numerics::initial_guess,
     "where an iterative solver starts: one of linkwise.initial_guesses()"},
    {"stop", &Numerics::stop, "stopping test of an iterative solver: one of linkwise.stop_rules()"},
    {"solver_tolerance", &Numerics::solver_tolerance,
     "what that test compares with, relative to the solution; by default the integrator's error "
     "test decides how accurate solutions have to be"},
    {"max_iterations", &Numerics::max_iterations, "most iterations of one solution"},
    {"state", &Numerics::state,
     "what is integrated beside the coordinates: joint_rates, or body_velocities, the bodies' own "
     "velocities [sharf1993] (method constraint_force only)"},
    {"assemble", &Numerics::assemble,
     "what becomes of a start that leaves closed loops open: nearest, the position nearby that "
     "closes them, or exact, it is refused"},
};

/// The share of a run's tolerance that one step may take, because the errors of hundreds of steps
/// add up. Measured on random trees (docs/theory/integrate.md): it keeps the energy of nearly all
/// of them within ten tolerances over 10 s, for a third more evaluations.
constexpr double step_share = 0.1;

bool positive(double x) { return x > 0 && std::isfinite(x); }

}  // namespace

std::span<const NumericsEntry> numerics_table() { return table; }

const NumericsEntry& find_numerics(std::string_view name) {
  return find_named("option", name, table);
}

SimulationOptions simulation_options(const Numerics& n, const Executor& executor,
                                     const SolverOptionValues& solver_options) {
  SimulationOptions o;
  o.dynamics.executor = executor;
  if (!positive(n.tolerance))
    throw InputError("tolerance must be a positive number; 1e-6 is usual");
  const double allowed_per_step = n.step_tolerance.value_or(step_share * n.tolerance);
  if (!positive(allowed_per_step))
    throw InputError("step_tolerance must be a positive number; a tenth of tolerance is usual");
  o.dynamics.method = n.method;
  o.dynamics.solver = n.solver;
  o.dynamics.initial_guess = n.initial_guess;
  o.dynamics.solver_options.stop = stop_rule_from_name(n.stop);
  // The constraint forces perturb the accelerations by as much: a tenth of the step's error
  // [sharf1993].
  o.dynamics.solver_options.tolerance = n.solver_tolerance.value_or(allowed_per_step / 10);
  o.dynamics.solver_options.max_iterations = n.max_iterations.value_or(0);
  o.follow_error_test = !n.solver_tolerance;
  for (const auto& [name, value] : solver_options)
    if (name == "tolerance" || name == "absolute_tolerance") o.follow_error_test = false;
  set_options(o.dynamics.solver_options, solver_options);
  o.state = find_state(n.state);
  if (n.assemble != "nearest" && n.assemble != "exact")
    throw InputError("assemble '" + n.assemble + "' is unknown; known: nearest, exact");
  o.exact_start = n.assemble == "exact";
  o.integrator = find_integrator(n.integrator).name;
  o.integration.tolerance = allowed_per_step;
  o.integration.step = n.step.value_or(0.0);
  o.integration.max_step = n.max_step.value_or(0.0);
  o.integration.max_steps = n.max_steps.value_or(0);
  return o;
}

}  // namespace linkwise
