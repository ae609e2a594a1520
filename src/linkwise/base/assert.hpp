#pragma once

#include <cstdio>
#include <cstdlib>

namespace linkwise::detail {

[[noreturn]] inline void assertion_failed(const char* condition, const char* message,
                                          const char* file, int line) {
  std::fprintf(stderr, "%s:%d: assertion failed: %s (%s)\n", file, line, condition, message);
  std::abort();
}

}  // namespace linkwise::detail

/// Guards against mistakes of the programmer; mistakes of the user throw InputError instead.
/// Compiled in when LINKWISE_ASSERTIONS is 1 (presets dev, asan, tsan), unevaluated otherwise.
#if defined(LINKWISE_ASSERTIONS) && LINKWISE_ASSERTIONS
#define LINKWISE_ASSERT(condition, message) \
  ((condition) ? static_cast<void>(0)       \
               : ::linkwise::detail::assertion_failed(#condition, message, __FILE__, __LINE__))
#else
#define LINKWISE_ASSERT(condition, message) static_cast<void>(sizeof((condition) ? 1 : 0))
#endif
