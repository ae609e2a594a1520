#pragma once
// Worker threads that wait between regions. Tasks of a region share nothing, and the caller makes
// sums over them in order. So which thread runs which task never influences a result.
#include <functional>

namespace linkwise {

/// The default number of threads: LINKWISE_THREADS, or the cores that this process may use.
/// InputError if the variable is not a number in range.
int default_threads();

inline constexpr int max_threads = 1024;

/// Runs task(0) ... task(n - 1) on up to `threads` threads, this one included, and returns when all
/// are done. A region started while another one runs (from elsewhere, or from inside a task) is run
/// by its caller alone. Exceptions of tasks reach the caller.
void parallel_for(int n, int threads, const std::function<void(int)>& task);

}  // namespace linkwise
