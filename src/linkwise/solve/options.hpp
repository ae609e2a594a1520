#pragma once
// Options by name. A solver (or initial guess) states its own beside its code, one Option each:
// users' spellings, checks, listings and documents all come from these rows.

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace linkwise {

using OptionValue = std::variant<bool, int, double, std::string>;

struct Option {
  std::string_view name;
  /// When not given. Its type is the option's.
  std::variant<bool, int, double, std::string_view> fallback;
  std::string_view text;              ///< what it is and its unit
  std::string_view choices = "";      ///< of an option that is a name: "optimal, given, adaptive"
  bool (*accepts)(double) = nullptr;  ///< of a number; null: any finite one
  std::string_view wanted = "";       ///< what to give instead of a number that is not accepted
};

/// "a number", "a whole number", "True or False" or "a name in quotes".
std::string_view kind_text(const Option& option);
/// The value in the option's own type. InputError when it has another type or is out of range.
OptionValue checked(const Option& option, OptionValue value);

/// Values that were given; the rest have their defaults.
class OptionValues {
 public:
  void set(const Option& option, OptionValue value);
  bool given(const Option& option) const { return find(option) != nullptr; }

  double number(const Option& option) const { return get<double>(option); }
  int count(const Option& option) const { return get<int>(option); }
  bool flag(const Option& option) const { return get<bool>(option); }
  /// Is the option this one of its choices?
  bool is(const Option& option, std::string_view choice) const;

  bool operator==(const OptionValues&) const = default;

 private:
  const OptionValue* find(const Option& option) const;
  template <class T>
  T get(const Option& option) const {
    const OptionValue* const value = find(option);
    return value ? std::get<T>(*value) : std::get<T>(option.fallback);
  }

  std::vector<std::pair<std::string_view, OptionValue>> values_;
};

using OptionList = std::span<const Option>();
inline std::span<const Option> no_options() { return {}; }

/// Ranges that several options share.
inline bool at_least_zero(double x) { return x >= 0.0; }
inline bool at_least_one(double x) { return x >= 1.0; }

}  // namespace linkwise
