#include "linkwise/exec/thread_pool.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#if defined(__linux__)
#include <sched.h>
#endif

#include "linkwise/base/error.hpp"

namespace linkwise {
namespace {

int available_cores() {
#if defined(__linux__)
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof(set), &set) == 0) return std::max(1, CPU_COUNT(&set));
#endif
  return std::max(1u, std::thread::hardware_concurrency());
}

/// A region is one number: its index in the upper bits, tasks not yet claimed in the lower bits.
/// Every thread that is awake claims the next task, so a worker that the system does not run delays
/// nobody.
class Pool {
 public:
  static Pool& instance() {
    static Pool pool;
    return pool;
  }

  void run(int n, int threads, const std::function<void(int)>& task) {
    const int helpers = std::min(threads, n) - 1;
    if (helpers < 1 || !region_.try_lock()) {
      for (int i = 0; i < n; ++i) task(i);
      return;
    }
    const std::lock_guard guard(region_, std::adopt_lock);
    while (static_cast<int>(workers_.size()) < helpers) {
      const int index = static_cast<int>(workers_.size());
      workers_.emplace_back([this, index, seen = number_] { work(index, seen); });
    }
    task_ = &task;
    error_ = nullptr;
    done_.store(0, std::memory_order_relaxed);
    helpers_.store(helpers, std::memory_order_relaxed);
    ++number_;
    ticket_.store(std::uint64_t{number_} << 32 | static_cast<std::uint32_t>(n),
                  std::memory_order_release);
    signal_.store(number_, std::memory_order_release);
    signal_.notify_all();
    share(number_);
    for (int i = 0; done_.load(std::memory_order_acquire) < n; ++i)
      i < spins ? relax() : std::this_thread::yield();
    if (error_) std::rethrow_exception(error_);
  }

 private:
  ~Pool() {
    stop_.store(true, std::memory_order_relaxed);
    signal_.fetch_add(1, std::memory_order_release);
    signal_.notify_all();
    for (std::thread& worker : workers_) worker.join();
  }

  static void relax() {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }

  /// Claims and runs tasks of region `number` until none is left.
  void share(std::uint32_t number) {
    std::uint64_t ticket = ticket_.load(std::memory_order_acquire);
    for (;;) {
      const auto left = static_cast<std::uint32_t>(ticket);
      if (ticket >> 32 != number || left == 0) return;
      if (!ticket_.compare_exchange_weak(ticket, ticket - 1, std::memory_order_acq_rel)) continue;
      try {
        (*task_)(static_cast<int>(left - 1));
      } catch (...) {
        const std::lock_guard lock(error_mutex_);
        if (!error_) error_ = std::current_exception();
      }
      done_.fetch_add(1, std::memory_order_acq_rel);
      ticket = ticket_.load(std::memory_order_acquire);
    }
  }

  void work(int index, std::uint32_t seen) {
    for (;;) {
      std::uint32_t now = signal_.load(std::memory_order_acquire);
      for (int i = 0; i < spins && now == seen; ++i) {
        relax();
        now = signal_.load(std::memory_order_acquire);
      }
      if (now == seen) {
        signal_.wait(seen, std::memory_order_acquire);
        continue;
      }
      seen = now;
      if (stop_.load(std::memory_order_relaxed)) return;
      if (index < helpers_.load(std::memory_order_relaxed)) share(now);
    }
  }

  static constexpr int spins = 2000;  // some 10 us: several times the cost of a barrier
  std::mutex region_, error_mutex_;
  std::vector<std::thread> workers_;
  std::uint32_t number_ = 0;
  std::atomic<std::uint64_t> ticket_{0};
  std::atomic<std::uint32_t> signal_{0};
  std::atomic<int> done_{0}, helpers_{0};
  std::atomic<bool> stop_{false};
  const std::function<void(int)>* task_ = nullptr;
  std::exception_ptr error_;
};

}  // namespace

int default_threads() {
  const char* variable = std::getenv("LINKWISE_THREADS");
  if (!variable || !*variable) return std::min(available_cores(), max_threads);
  char* end = nullptr;
  const long n = std::strtol(variable, &end, 10);
  if (*end || n < 1 || n > max_threads)
    throw InputError("LINKWISE_THREADS is '" + std::string(variable) +
                     "'; set a whole number from 1 to " + std::to_string(max_threads) +
                     " or unset it");
  return static_cast<int>(n);
}

void parallel_for(int n, int threads, const std::function<void(int)>& task) {
  Pool::instance().run(n, threads, task);
}

}  // namespace linkwise
