#include "linkwise/exec/thread_pool.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>
#include <thread>
#include <utility>

#if defined(__linux__)
#include <sched.h>
#endif
#if defined(__unix__) || defined(__APPLE__)
#define LINKWISE_CAN_FORK
#include <pthread.h>
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
/// nobody. There is no lock that a fork could find taken.
class Pool {
 public:
  static Pool& instance() {
    static Pool& pool = first();
    return pool;
  }

  void run(int n, int threads, const std::function<void(int)>& task) {
    const int helpers = std::min(threads, n) - 1;
    if (helpers < 1 || busy_.exchange(true, std::memory_order_acquire)) {
      for (int i = 0; i < n; ++i) task(i);
      return;
    }
    start_workers(helpers);
    const unsigned life = lives;
    task_ = &task;
    failed_.store(false, std::memory_order_relaxed);
    done_.store(0, std::memory_order_relaxed);
    helpers_.store(helpers, std::memory_order_relaxed);
    ++number_;
    ticket_.store(std::uint64_t{number_} << 32 | static_cast<std::uint32_t>(n),
                  std::memory_order_release);
    signal_.store(number_, std::memory_order_release);
    signal_.notify_all();
    share(number_);
    if (lives != life)  // the workers did not come along, nor what they had begun
      throw InputError("the process was forked inside a computation of linkwise; fork outside");
    for (int i = 0; done_.load(std::memory_order_acquire) < n; ++i)
      i < spins ? relax() : std::this_thread::yield();
    const std::exception_ptr error = std::exchange(error_, nullptr);
    busy_.store(false, std::memory_order_release);
    if (error) std::rethrow_exception(error);
  }

 private:
  /// Nobody destroys the pool: when a process ends, its other threads may still compute, and those
  /// of a parent process are no threads of a forked child. A child begins with a pool of its own.
  static Pool& first() {
    alignas(Pool) static std::byte place[sizeof(Pool)];
#ifdef LINKWISE_CAN_FORK
    pthread_atfork(nullptr, nullptr, [] {
      ::new (place) Pool;
      ++lives;
    });
#endif
    return *::new (place) Pool;
  }

  /// As many as there is room for. They never end, and nobody waits for their end.
  void start_workers(int wanted) {
    try {
      for (; workers_ < wanted; ++workers_)
        std::thread([this, index = workers_, seen = number_] { work(index, seen); }).detach();
    } catch (const std::exception&) {  // no room for more: the others claim their tasks
    }
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
        if (!failed_.exchange(true, std::memory_order_relaxed)) error_ = std::current_exception();
      }
      done_.fetch_add(1, std::memory_order_acq_rel);
      ticket = ticket_.load(std::memory_order_acquire);
    }
  }

  [[noreturn]] void work(int index, std::uint32_t seen) {
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
      if (index < helpers_.load(std::memory_order_relaxed)) share(now);
    }
  }

  static constexpr int spins = 2000;  // some 10 us: several times the cost of a barrier
  static inline unsigned lives = 0;   // forks that led to this process, since the first region
  std::atomic<bool> busy_{false}, failed_{false};
  int workers_ = 0;
  std::uint32_t number_ = 0;
  std::atomic<std::uint64_t> ticket_{0};
  std::atomic<std::uint32_t> signal_{0};
  std::atomic<int> done_{0}, helpers_{0};
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
