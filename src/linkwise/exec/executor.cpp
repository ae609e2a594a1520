#include "linkwise/exec/executor.hpp"

#include <string>

#include "linkwise/base/error.hpp"

namespace linkwise {

Executor executor_for(std::optional<int> threads) {
  if (!threads) return Executor(default_threads());
  if (*threads < 1 || *threads > max_threads)
    throw InputError("threads is " + std::to_string(*threads) + "; give a whole number from 1 to " +
                     std::to_string(max_threads) + ", or nothing for all cores");
  return Executor(*threads);
}

Executor executor_for(std::optional<int> threads, std::size_t bodies) {
  if (threads) return executor_for(threads);
  return bodies < static_cast<std::size_t>(Worth::call) ? Executor() : executor_for(threads);
}

}  // namespace linkwise
