#pragma once
// Worker threads that wait between regions. A region's tasks are dealt out by index, so who does
// what never influences a result: tasks share nothing, and sums over them are made by the caller in
// order.
#include <functional>

namespace linkwise {

/// Threads to use where none are asked for: LINKWISE_THREADS, or the cores this process may use.
/// InputError when the variable is no number in range.
int default_threads();

/// 0 stands for the default. InputError below 1 or above the limit.
int checked_threads(int asked);
inline constexpr int max_threads = 1024;

/// Runs task(0) ... task(n - 1) on up to `threads` threads, this one included, and returns when all
/// are done. A region started while another one runs (from elsewhere, or from inside a task) is run
/// by its caller alone. Exceptions of tasks reach the caller.
void parallel_for(int n, int threads, const std::function<void(int)>& task);

}  // namespace linkwise
