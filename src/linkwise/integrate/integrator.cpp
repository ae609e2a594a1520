#include "linkwise/integrate/integrator.hpp"

#include <cmath>
#include <cstdio>
#include <string>

#include "linkwise/base/error.hpp"
#include "linkwise/base/named.hpp"

namespace linkwise {

using MakeIntegrator = std::unique_ptr<Integrator>(OdeSystem&, const IntegratorOptions&);
MakeIntegrator make_auto, make_adams, make_bdf, make_runge_kutta_4, make_semi_implicit_euler;
MakeIntegrator make_runge_kutta_8, make_esdirk;

namespace {

constexpr IntegratorEntry entries[] = {
#if defined(LINKWISE_WITH_SUNDIALS)
    {.name = "auto",
     .description = "adams, and bdf where the motion turns out to be stiff",
     .highest_order = 12,
     .make = make_auto},
    {.name = "adams",
     .description = "variable-order Adams, 1 to 12, functional iteration (CVODE); for motion that "
                    "is not stiff",
     .highest_order = 12,
     .make = make_adams},
    {.name = "bdf",
     .description = "variable-order backward differentiation, 1 to 5, Newton iteration (CVODE); "
                    "for stiff springs and stops",
     .highest_order = 5,
     .make = make_bdf},
#endif
#if defined(LINKWISE_SUNDIALS_ARKODE)
    {.name = "esdirk",
     .description = "L-stable implicit Runge-Kutta of order 5, Newton iteration solved by the "
                    "recursion (ARKODE); for elastic links, stiff springs and stops",
     .highest_order = 5,
     .make = make_esdirk},
#endif
    {.name = "runge_kutta_8",
     .description =
         "Runge-Kutta of order 8 (Dormand and Prince); without a history, to check the others by",
     .highest_order = 8,
     .make = make_runge_kutta_8},
    {.name = "runge_kutta_4",
     .description = "classical Runge-Kutta of order 4 with a fixed step; no error control",
     .highest_order = 4,
     .fixed_step = true,
     .make = make_runge_kutta_4},
    {.name = "semi_implicit_euler",
     .description = "semi-implicit Euler of order 1 with a fixed step; no error control",
     .highest_order = 1,
     .fixed_step = true,
     .make = make_semi_implicit_euler},
};

[[noreturn]] void reject(std::string_view option, double value, std::string_view rule) {
  char number[32];
  std::snprintf(number, sizeof number, "%g", value);
  throw InputError("integrator option " + std::string(option) + " is " + number + "; " +
                   std::string(rule));
}

bool positive(double value) { return std::isfinite(value) && value > 0.0; }
bool positive_or_zero(double value) { return std::isfinite(value) && value >= 0.0; }

void check(const IntegratorEntry& entry, const IntegratorOptions& options) {
  if (!positive(options.tolerance)) {
    reject("tolerance", options.tolerance, "give a positive number such as 1e-6");
  }
  if (!positive_or_zero(options.relative_tolerance)) {
    reject("relative_tolerance", options.relative_tolerance, "give a positive number");
  }
  if (!positive_or_zero(options.absolute_tolerance)) {
    reject("absolute_tolerance", options.absolute_tolerance, "give a positive number");
  }
  if (!positive_or_zero(options.max_step)) {
    reject("max_step", options.max_step, "give a positive number of seconds, or 0 for no bound");
  }
  if (entry.fixed_step && !positive(options.step)) {
    reject("step", options.step,
           std::string(entry.name) + " needs a fixed step: give a positive number of seconds");
  }
  if (!entry.fixed_step && options.step != 0.0) {
    reject("step", options.step,
           std::string(entry.name) + " chooses its own: leave it out, or bound it with max_step");
  }
  if (options.max_order < 0 || options.max_order > entry.highest_order) {
    reject("max_order", options.max_order,
           std::string(entry.name) + " takes 1 to " + std::to_string(entry.highest_order) +
               ", or 0 for the highest");
  }
  if (options.max_steps < 0) {
    reject("max_steps", static_cast<double>(options.max_steps),
           "give a positive number, or 0 for no bound");
  }
}

}  // namespace

std::span<const IntegratorEntry> integrator_registry() { return entries; }

const IntegratorEntry& find_integrator(std::string_view name) {
  for (const IntegratorEntry& entry : entries)
    if (entry.name == name) return entry;
#if defined(LINKWISE_WITH_SUNDIALS)
  constexpr std::string_view why = "";
#else
  constexpr std::string_view why =
      "; this build has no SUNDIALS, hence no auto, adams, bdf, esdirk";
#endif
  throw InputError(unknown_name("integrator", name, entries) + std::string(why));
}

std::string fixed_step_names() {
  std::string names;
  for (const IntegratorEntry& entry : entries)
    if (entry.fixed_step) names += (names.empty() ? "" : " or ") + std::string(entry.name);
  return names;
}

void check_integrator(std::string_view name, const IntegratorOptions& options) {
  check(find_integrator(name), options);
}

std::unique_ptr<Integrator> make_integrator(std::string_view name, OdeSystem& system,
                                            const IntegratorOptions& options) {
  const IntegratorEntry& entry = find_integrator(name);
  check(entry, options);
  return entry.make(system, options);
}

}  // namespace linkwise
