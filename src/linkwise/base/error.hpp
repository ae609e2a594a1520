#pragma once

#include <stdexcept>

namespace linkwise {

/// A mistake in what the user gave: one line that names the file, the element and the remedy.
/// In Python it arrives as linkwise.InputError, a subclass of ValueError.
class InputError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

}  // namespace linkwise
