#pragma once
// Where work runs: handed from class to class in place of a number of threads, held by value.

#include <functional>

#include "linkwise/exec/thread_pool.hpp"

namespace linkwise {

class Executor {
 public:
  Executor() = default;  ///< the calling thread alone
  /// The calling thread and threads - 1 others; checked_threads() judges what users ask for.
  explicit Executor(int threads) : threads_(threads) {}

  int threads() const { return threads_; }
  bool operator==(const Executor&) const = default;

  /// f(0) ... f(n - 1), in any order and at the same time; returns when all are done. Tasks share
  /// nothing, so the number of threads changes no result. Allocates nothing.
  template <class F>
  void for_each(int n, F&& f) const {
    parallel_for(n, threads_, std::ref(f));
  }

 private:
  int threads_ = 1;
};

}  // namespace linkwise
