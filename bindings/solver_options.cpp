#include "solver_options.hpp"

#include <nanobind/stl/string.h>

#include "linkwise/base/error.hpp"
#include "linkwise/solve/registry.hpp"

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
  nb::list out;
  for (const SolverOption& known : solver_options()) {
    const Option& option = *known.option;
    const std::string owners = known.owners.empty() ? "" : known.owners + ": ";
    nb::dict entry;
    entry["name"] = std::string(option.name);
    entry["default"] = std::visit(
        [](auto fallback) {
          if constexpr (std::is_same_v<decltype(fallback), std::string_view>)
            return nb::object(nb::cast(std::string(fallback)));
          else
            return nb::object(nb::cast(fallback));
        },
        option.fallback);
    entry["description"] = owners + std::string(option.text);
    out.append(entry);
  }
  return out;
}

}  // namespace linkwise::bindings
