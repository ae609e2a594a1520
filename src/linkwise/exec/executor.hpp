#pragma once
// Where work runs: handed from class to class in place of a number of threads, held by value.

#include <cstddef>
#include <functional>
#include <optional>

#include "linkwise/exec/thread_pool.hpp"

namespace linkwise {

/// Bodies, of some 40 ns each, that one thread should get before a second one pays.
enum class Worth {
  region = 128,  ///< of one region among several: a barrier costs about 1 us, the threads are awake
  call = 512,    ///< of one call by itself: the threads may have to be woken
};

class Executor {
 public:
  Executor() = default;  ///< the calling thread alone
  /// The calling thread and threads - 1 others. What users ask for goes through executor_for().
  explicit Executor(int threads) : threads_(threads) {}

  int threads() const { return threads_; }
  bool operator==(const Executor&) const = default;

  /// This one for work that pays for a second thread, else the calling thread alone.
  Executor where_it_pays(Worth of, std::size_t bodies) const {
    return bodies < static_cast<std::size_t>(of) ? Executor() : *this;
  }

  /// f(0) ... f(n - 1), in any order and at the same time; returns when all are done. Tasks share
  /// nothing, so the number of threads changes no result. Allocates nothing.
  template <class F>
  void for_each(int n, F&& f) const {
    parallel_for(n, threads_, std::ref(f));
  }

 private:
  int threads_ = 1;
};

/// What a user asks for: a number of threads, or none for the default, which is LINKWISE_THREADS or
/// the cores that this process may use. The default is the calling thread alone, and not looked up,
/// where the call's work does not pay for a second thread. InputError where a number is out of
/// range.
Executor executor_for(std::optional<int> threads);
Executor executor_for(std::optional<int> threads, std::size_t bodies);

}  // namespace linkwise
