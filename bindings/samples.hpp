#pragma once
// Arrays for what a simulation records, as its table of quantities describes them.
#include <cstdint>

#include "arrays.hpp"
#include "linkwise/simulate/quantity.hpp"

namespace linkwise::bindings {

/// One array per wanted quantity of shape lead + its own axes, whole numbers as int64.
struct Columns {
  /// wanted: groups of quantities; None: all.
  Columns(const Model& model, const Shape& lead, nb::handle wanted);

  std::vector<std::pair<std::string, nb::object>> arrays;  ///< by name
  Sample sample;                                           ///< their first row

  /// As Python gets them, cut to the first n rows of the first axis where n is smaller.
  nb::dict to_python(size_t n) const;
};

}  // namespace linkwise::bindings
