#pragma once
// Tables of the core as Python gets them: a list with a dictionary per row.
#include <string>
#include <string_view>
#include <type_traits>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

namespace linkwise::bindings {

/// fill(row, entry) for every entry; row("name", value) adds a column, texts as Python's.
template <class Table, class Fill>
nanobind::list table_rows(const Table& table, Fill&& fill) {
  nanobind::list out;
  for (const auto& entry : table) {
    nanobind::dict row;
    fill(
        [&row](const char* column, const auto& value) {
          if constexpr (std::is_convertible_v<decltype(value), std::string_view>)
            row[column] = std::string(std::string_view(value));
          else
            row[column] = value;
        },
        entry);
    out.append(row);
  }
  return out;
}

}  // namespace linkwise::bindings
