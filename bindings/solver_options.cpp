#include "solver_options.hpp"

#include <nanobind/stl/string.h>

#include "linkwise/base/error.hpp"

namespace linkwise::bindings {
namespace {

namespace nb = nanobind;

[[noreturn]] void refuse(std::string_view key, nb::handle value, const char* wanted) {
  throw InputError("solver_options['" + std::string(key) + "'] is " +
                   nb::cast<std::string>(nb::str(nb::repr(value))) + "; give " + wanted);
}

double to_number(std::string_view key, nb::handle value) {
  double number = 0;
  if (nb::isinstance<nb::bool_>(value) || !nb::try_cast(value, number))
    refuse(key, value, "a number");
  return number;
}

int to_count(std::string_view key, nb::handle value) {
  int count = 0;
  if (nb::isinstance<nb::bool_>(value) || !nb::try_cast(value, count))
    refuse(key, value, "a whole number");
  return count;
}

std::string to_name(std::string_view key, nb::handle value) {
  std::string name;
  if (!nb::try_cast(value, name)) refuse(key, value, "a name in quotes");
  return name;
}

struct Option {
  std::string_view name, description;
  void (*set)(std::string_view key, nb::handle value, DynamicsOptions& options);
  nb::object (*get)(const DynamicsOptions& options);
};

#define LW_OPTION(convert, member)                                 \
  [](std::string_view key, nb::handle value, DynamicsOptions& o) { \
    o.member = convert(key, value);                                \
  },                                                               \
      [](const DynamicsOptions& o) { return nb::cast(o.member); }
#define LW_CHOICE(from_name, member)                                   \
  [](std::string_view key, nb::handle value, DynamicsOptions& o) {     \
    o.member = from_name(to_name(key, value));                         \
  },                                                                   \
      [](const DynamicsOptions& o) {                                   \
        return nb::object(nb::cast(std::string(to_string(o.member)))); \
      }

bool to_flag(std::string_view key, nb::handle value) {
  if (!nb::isinstance<nb::bool_>(value)) refuse(key, value, "True or False");
  return nb::cast<bool>(value);
}

constexpr Option table[] = {
    {"tolerance", "what the stop rule compares with",
     LW_OPTION(to_number, solver_options.tolerance)},
    {"absolute_tolerance", "added to the bound of stop rule energy_norm, sqrt(J)/s",
     LW_OPTION(to_number, solver_options.absolute_tolerance)},
    {"max_iterations", "most iterations of a solution; 0: the solver's own limit",
     LW_OPTION(to_count, solver_options.max_iterations)},
    {"stop", "stop rule: paper, residual or energy_norm",
     LW_CHOICE(stop_rule_from_name, solver_options.stop)},
    {"form", "conjugate_gradient: two_term or three_term",
     LW_CHOICE(conjugate_gradient_form_from_name, solver_options.form)},
    {"relaxation", "sor, red_black_sor: optimal, given or adaptive; given when omega is",
     LW_CHOICE(relaxation_choice_from_name, solver_options.relaxation)},
    {"omega", "sor, red_black_sor: the factor, in (0, 2)",
     LW_OPTION(to_number, solver_options.omega)},
    {"spectral_radius", "sor, chebyshev: of 1 - D^-1 A, in (0, 1); 0: estimated",
     LW_OPTION(to_number, solver_options.spectral_radius)},
    {"block_size", "block_schwarz_conjugate_gradient, two_level: joints a piece; 0: default",
     LW_OPTION(to_count, solver_options.block_size)},
    {"refinement_steps", "direct solvers: steps of iterative refinement",
     LW_OPTION(to_count, solver_options.refinement_steps)},
    {"estimate_error", "direct solvers: estimate the error",
     LW_OPTION(to_flag, solver_options.estimate_error)},
    {"lag_limit", "lagged_thomas: iterations after which the factor is renewed",
     LW_OPTION(to_count, solver_options.lag_limit)},
    {"history", "initial guess projection: solutions kept", LW_OPTION(to_count, history)},
};

#undef LW_OPTION
#undef LW_CHOICE

}  // namespace

void read_solver_options(nb::handle given, DynamicsOptions& options) {
  if (given.is_none()) return;
  if (!nb::isinstance<nb::dict>(given))
    throw InputError("solver_options is not a dictionary; give e.g. {'omega': 1.5}");
  bool has_omega = false, has_relaxation = false;
  for (auto [key_object, value] : nb::cast<nb::dict>(given)) {
    const std::string key = nb::cast<std::string>(nb::str(key_object));
    const Option* found = nullptr;
    std::string known;
    for (const Option& option : table) {
      if (option.name == key) found = &option;
      known += (known.empty() ? "" : ", ") + std::string(option.name);
    }
    if (!found) throw InputError("solver_options: unknown key '" + key + "'; known: " + known);
    found->set(key, value, options);
    has_omega |= key == "omega";
    has_relaxation |= key == "relaxation";
  }
  if (has_omega && !has_relaxation) options.solver_options.relaxation = RelaxationChoice::given;
  validate(options.solver_options);
  if (options.history < 1)
    throw InputError("solver_options['history'] is " + std::to_string(options.history) +
                     "; give 1 or more");
}

bool gives_tolerance(nb::handle given) {
  if (!nb::isinstance<nb::dict>(given)) return false;
  const auto options = nb::cast<nb::dict>(given);
  return options.contains("tolerance") || options.contains("absolute_tolerance");
}

nb::list solver_option_list() {
  nb::list out;
  const DynamicsOptions defaults;
  for (const Option& option : table) {
    nb::dict entry;
    entry["name"] = std::string(option.name);
    entry["default"] = option.get(defaults);
    entry["description"] = std::string(option.description);
    out.append(entry);
  }
  return out;
}

}  // namespace linkwise::bindings
