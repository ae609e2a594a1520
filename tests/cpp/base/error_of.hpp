#pragma once
// What users are told.

#include <string>

#include "linkwise/base/error.hpp"

namespace linkwise::testing {

/// The message with which an action is refused.
template <class Action>
std::string error_of(Action&& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace linkwise::testing
