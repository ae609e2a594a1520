#include "linkwise/solve/solver.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "linkwise/base/error.hpp"

namespace linkwise {
namespace {

template <class Enum, std::size_t count>
using NameTable = std::array<std::pair<Enum, std::string_view>, count>;

constexpr NameTable<StopRule, 3> stop_rules{{{StopRule::paper, "paper"},
                                             {StopRule::residual, "residual"},
                                             {StopRule::energy_norm, "energy_norm"}}};

constexpr NameTable<ConjugateGradientForm, 2> forms{
    {{ConjugateGradientForm::two_term, "two_term"},
     {ConjugateGradientForm::three_term, "three_term"}}};

constexpr NameTable<RelaxationChoice, 3> relaxations{{{RelaxationChoice::optimal, "optimal"},
                                                      {RelaxationChoice::given, "given"},
                                                      {RelaxationChoice::adaptive, "adaptive"}}};

template <class Enum, std::size_t count>
Enum from_name(const NameTable<Enum, count>& table, std::string_view what, std::string_view name) {
  for (const auto& [value, known] : table)
    if (known == name) return value;
  std::string text = "unknown " + std::string(what) + " '" + std::string(name) + "'; known are";
  for (std::size_t i = 0; i < count; ++i) text += (i ? ", " : " ") + std::string(table[i].second);
  throw InputError(text);
}

template <class Enum, std::size_t count>
std::string_view to_name(const NameTable<Enum, count>& table, Enum value) {
  for (const auto& [known, name] : table)
    if (known == value) return name;
  return "?";
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace

std::string_view to_string(StopRule rule) { return to_name(stop_rules, rule); }
StopRule stop_rule_from_name(std::string_view name) {
  return from_name(stop_rules, "stop rule", name);
}
std::string_view to_string(ConjugateGradientForm form) { return to_name(forms, form); }
ConjugateGradientForm conjugate_gradient_form_from_name(std::string_view name) {
  return from_name(forms, "form of conjugate gradients", name);
}
std::string_view to_string(RelaxationChoice choice) { return to_name(relaxations, choice); }
RelaxationChoice relaxation_choice_from_name(std::string_view name) {
  return from_name(relaxations, "choice of the relaxation factor", name);
}

void validate(const SolverOptions& o) {
  const auto reject = [](const std::string& text) { throw InputError("solver options: " + text); };
  if (!(o.tolerance > 0.0) || !std::isfinite(o.tolerance))
    reject("tolerance is " + number(o.tolerance) + "; give a number above 0");
  if (!(o.absolute_tolerance >= 0.0) || !std::isfinite(o.absolute_tolerance))
    reject("absolute_tolerance is " + number(o.absolute_tolerance) + "; give 0 or more");
  if (o.max_iterations < 0)
    reject("max_iterations is " + std::to_string(o.max_iterations) +
           "; give 1 or more, or 0 for the solver's own limit");
  if (!(o.omega > 0.0 && o.omega < 2.0))
    reject("omega is " + number(o.omega) + "; over-relaxation converges for 0 < omega < 2 only");
  if (!(o.spectral_radius >= 0.0 && o.spectral_radius < 1.0))
    reject("spectral_radius is " + number(o.spectral_radius) +
           "; give a number in (0, 1), or 0 to have it estimated");
  if (o.block_size < 0)
    reject("block_size is " + std::to_string(o.block_size) +
           "; give 1 or more, or 0 for the solver's default");
  if (o.refinement_steps < 0)
    reject("refinement_steps is " + std::to_string(o.refinement_steps) + "; give 0 or more");
  if (o.lag_limit < 1) reject("lag_limit is " + std::to_string(o.lag_limit) + "; give 1 or more");
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
