#pragma once
// The clock of all programs here.
#include <chrono>
#include <ctime>

/// What calls took: seconds of the wall clock, and of the threads of this process together.
struct Taken {
  double seconds, cpu;
};

/// call(0) ... call(calls - 1).
template <class Call>
Taken timed(long calls, Call&& call) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t busy = std::clock();
  for (long i = 0; i < calls; ++i) call(i);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  return {seconds.count(), static_cast<double>(std::clock() - busy) / CLOCKS_PER_SEC};
}
