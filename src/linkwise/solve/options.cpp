#include "linkwise/solve/options.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "linkwise/base/error.hpp"

namespace linkwise {
namespace {

std::string to_text(const OptionValue& value) {
  if (const auto* name = std::get_if<std::string>(&value)) return "'" + *name + "'";
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* count = std::get_if<int>(&value)) return std::to_string(*count);
  char text[32];
  std::snprintf(text, sizeof text, "%g", std::get<double>(value));
  return text;
}

[[noreturn]] void refuse(const Option& option, const OptionValue& value,
                         const std::string& wanted) {
  throw InputError("solver options: " + std::string(option.name) + " is " + to_text(value) + "; " +
                   wanted);
}

/// Is the word one of "these, or, those"?
bool lists(std::string_view words, std::string_view word) {
  const std::string all = ", " + std::string(words) + ",";
  return all.find(", " + std::string(word) + ",") != std::string::npos;
}

}  // namespace

std::string_view kind_text(const Option& option) {
  constexpr std::string_view kinds[] = {"True or False", "a whole number", "a number",
                                        "a name in quotes"};
  return kinds[option.fallback.index()];
}

OptionValue checked(const Option& option, OptionValue value) {
  if (option.fallback.index() == 2 && value.index() == 1)
    value = static_cast<double>(std::get<int>(value));
  if (value.index() != option.fallback.index())
    refuse(option, value, "give " + std::string(kind_text(option)));
  if (const auto* name = std::get_if<std::string>(&value)) {
    if (!option.choices.empty() && !lists(option.choices, *name))
      refuse(option, value, "known are " + std::string(option.choices));
  } else if (!std::holds_alternative<bool>(value)) {
    const double number = value.index() == 1 ? std::get<int>(value) : std::get<double>(value);
    if (!std::isfinite(number) || (option.accepts && !option.accepts(number)))
      refuse(option, value, std::string(option.wanted));
  }
  return value;
}

void OptionValues::set(const Option& option, OptionValue value) {
  value = checked(option, std::move(value));
  for (auto& [name, old] : values_)
    if (name == option.name) {
      old = std::move(value);
      return;
    }
  values_.emplace_back(option.name, std::move(value));
}

bool OptionValues::is(const Option& option, std::string_view choice) const {
  const OptionValue* const value = find(option);
  return (value ? std::string_view(std::get<std::string>(*value))
                : std::get<std::string_view>(option.fallback)) == choice;
}

const OptionValue* OptionValues::find(const Option& option) const {
  const auto at = std::find_if(values_.begin(), values_.end(),
                               [&](const auto& entry) { return entry.first == option.name; });
  return at == values_.end() ? nullptr : &at->second;
}

}  // namespace linkwise
