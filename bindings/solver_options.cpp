#include "solver_options.hpp"

#include <nanobind/stl/string.h>

#include "linkwise/base/error.hpp"
#include "linkwise/solve/registry.hpp"
#include "table_rows.hpp"

namespace linkwise::bindings {
namespace {

namespace nb = nanobind;

/// The value in the option's type. Python's True is a whole number there, but not here.
OptionValue to_value(const Option& option, nb::handle value) {
  return std::visit(
      [&](auto fallback) -> OptionValue {
        using Given = decltype(fallback);
        using T = std::conditional_t<std::is_same_v<Given, std::string_view>, std::string, Given>;
        T out{};
        const bool is_flag = nb::isinstance<nb::bool_>(value);
        if (is_flag == std::is_same_v<T, bool> && nb::try_cast(value, out)) return out;
        throw InputError("solver_options['" + std::string(option.name) + "'] is " +
                         nb::cast<std::string>(nb::str(nb::repr(value))) + "; give " +
                         std::string(kind_text(option)));
      },
      option.fallback);
}

}  // namespace

SolverOptionValues solver_option_values(nb::handle given) {
  SolverOptionValues values;
  if (given.is_none()) return values;
  if (!nb::isinstance<nb::dict>(given))
    throw InputError("solver_options is not a dictionary; give e.g. {'omega': 1.5}");
  for (auto [key, value] : nb::cast<nb::dict>(given)) {
    const std::string name = nb::cast<std::string>(nb::str(key));
    values.emplace_back(name, to_value(find_option(name), value));
  }
  return values;
}

nb::list solver_option_list() {
  return table_rows(solver_options(), [](auto&& row, const SolverOption& known) {
    row("name", known.name);
    std::visit([&](const auto& fallback) { row("default", fallback); }, known.option->fallback);
    row("description",
        (known.owners.empty() ? "" : known.owners + ": ") + std::string(known.option->text));
  });
}

}  // namespace linkwise::bindings
