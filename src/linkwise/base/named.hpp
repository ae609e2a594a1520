#pragma once
// Looking names up in tables whose rows have a member `name`.
#include <string>
#include <string_view>

#include "linkwise/base/error.hpp"

namespace linkwise {

/// "WHAT 'NAME' is unknown; known: a, b, c". first: a name that is known beside the table's.
template <class Table>
std::string unknown_name(std::string_view what, std::string_view name, const Table& table,
                         std::string_view first = {}) {
  std::string known(first);
  for (const auto& row : table) known += (known.empty() ? "" : ", ") + std::string(row.name);
  return std::string(what) + " '" + std::string(name) + "' is unknown; known: " + known;
}

/// The row of that name. InputError where there is none, as unknown_name().
template <class Table>
const auto& find_named(std::string_view what, std::string_view name, const Table& table,
                       std::string_view first = {}) {
  for (const auto& row : table)
    if (row.name == name) return row;
  throw InputError(unknown_name(what, name, table, first));
}

}  // namespace linkwise
