#include "linkwise/solve/solver.hpp"

#include <utility>

#include "linkwise/base/named.hpp"
#include "linkwise/solve/registry.hpp"

namespace linkwise {
namespace {

constexpr StopRuleEntry stop_rules[] = {
    {"paper", "the last change, relative to the solution [sharf1993, section 5]"},
    {"residual", "the residual, relative to the right-hand side"},
    {"energy_norm", "the error in the A-norm, relative to the solution: estimated, then bounded"}};

bool positive(double x) { return x > 0.0; }

constexpr Option common[] = {
    {.name = "tolerance",
     .fallback = usual_tolerance,
     .text = "what the stop rule compares with",
     .accepts = positive,
     .wanted = "give a number above 0"},
    {.name = "absolute_tolerance",
     .fallback = 0.0,
     .text = "added to the bound of stop rule energy_norm, sqrt(J)/s",
     .accepts = at_least_zero,
     .wanted = "give 0 or more"},
    {.name = "max_iterations",
     .fallback = 0,
     .text = "most iterations of a solution; 0: the solver's own limit",
     .accepts = at_least_zero,
     .wanted = "give 1 or more, or 0 for the solver's own limit"},
    {.name = "stop",
     .fallback = std::string_view("energy_norm"),
     .text = "stop rule: paper, residual or energy_norm"},
};

}  // namespace

std::span<const StopRuleEntry> stop_rule_table() { return stop_rules; }

std::string_view to_string(StopRule rule) { return stop_rules[static_cast<int>(rule)].name; }

StopRule stop_rule_from_name(std::string_view name) {
  return static_cast<StopRule>(&find_named("stop rule", name, stop_rules) - stop_rules);
}

std::span<const Option> common_options() { return common; }

void SolverOptions::set(std::string_view name, OptionValue value) {
  const Option& option = find_option(name);
  value = checked(option, std::move(value));
  if (name == "tolerance")
    tolerance = std::get<double>(value);
  else if (name == "absolute_tolerance")
    absolute_tolerance = std::get<double>(value);
  else if (name == "max_iterations")
    max_iterations = std::get<int>(value);
  else if (name == "stop")
    stop = stop_rule_from_name(std::get<std::string>(value));
  else
    own.set(option, std::move(value));
}

SolverOptions make_solver_options(double tolerance, std::string_view stop, int max_iterations,
                                  const SolverOptionValues& values) {
  SolverOptions options;
  options.tolerance = tolerance;
  options.stop = stop_rule_from_name(stop);
  options.max_iterations = max_iterations;
  set_options(options, values);
  return options;
}

void set_options(SolverOptions& options, const SolverOptionValues& values) {
  for (const auto& [name, value] : values) options.set(name, value);
  if (!values.empty()) validate(options);
}

void validate(const SolverOptions& o) {
  checked(common[0], o.tolerance);
  checked(common[1], o.absolute_tolerance);
  checked(common[2], o.max_iterations);
}

void accumulate(Report& total, const Report& one) {
  total.iterations += one.iterations;
  if (!(one.error_estimate <= total.error_estimate)) total.error_estimate = one.error_estimate;
  if (one.ok() || !total.ok()) return;
  total.outcome = one.outcome;
  total.node = one.node;
}

Report LinearSolver::solve_many(const BlockTree& A, int count, std::span<const double> b,
                                std::span<double> x) {
  const std::size_t size = static_cast<std::size_t>(A.size());
  Report total;
  for (int k = 0; k < count; ++k)
    accumulate(total, solve(A, b.subspan(k * size, size), x.subspan(k * size, size)));
  return total;
}

}  // namespace linkwise
