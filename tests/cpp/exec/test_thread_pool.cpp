#include <atomic>
#include <cstdlib>
#include <stdexcept>
#include <thread>
#include <vector>

#if defined(__unix__)
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <gtest/gtest.h>

#include "linkwise/base/error.hpp"
#include "linkwise/exec/thread_pool.hpp"

namespace linkwise {
namespace {

TEST(ThreadsPool, RunsEveryTaskOnceForAnyNumberOfThreads) {
  for (int threads : {1, 2, 3, 7})
    for (int n : {0, 1, 2, 3, 8, 100}) {
      std::vector<int> runs(n, 0);
      parallel_for(n, threads, [&](int i) { ++runs[i]; });
      EXPECT_EQ(runs, std::vector<int>(n, 1)) << n << " tasks on " << threads;
    }
}

TEST(ThreadsPool, ManyRegionsInARow) {
  std::vector<long> sums(4, 0);
  for (int region = 0; region < 5000; ++region)
    parallel_for(4, 3, [&](int i) { sums[i] += region; });
  for (long sum : sums) EXPECT_EQ(sum, 5000L * 4999 / 2);
}

TEST(ThreadsPool, NestedAndConcurrentRegionsRunInTheirCallers) {
  std::atomic<int> count{0};
  const auto nested = [&] {
    parallel_for(4, 2, [&](int) { parallel_for(3, 2, [&](int) { ++count; }); });
  };
  std::vector<std::thread> callers;
  for (int i = 0; i < 3; ++i) callers.emplace_back(nested);
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(count, 3 * 4 * 3);
}

TEST(ThreadsPool, ExceptionsReachTheCallerAndThePoolGoesOn) {
  const auto fail = [](int i) {
    if (i == 5) throw std::runtime_error("task 5");
  };
  EXPECT_THROW(parallel_for(8, 2, fail), std::runtime_error);
  std::atomic<int> count{0};
  parallel_for(8, 2, [&](int) { ++count; });
  EXPECT_EQ(count, 8);
}

#if defined(__unix__) && !defined(__SANITIZE_THREAD__)  // that sanitizer takes no such forks
/// How a child process ends that computes f, from 0 to 255.
template <class F>
int in_child(F&& f) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(600);
    _exit(f());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 255;
}

int sum_in_parallel() {
  std::atomic<int> sum{0};
  parallel_for(20, 3, [&](int i) { sum += i; });
  return sum;
}

TEST(ThreadsPool, AForkedChildHasWorkersOfItsOwn) {
  EXPECT_EQ(sum_in_parallel(), 190);
  EXPECT_EQ(in_child([] { return in_child(sum_in_parallel) == 190 ? sum_in_parallel() : 0; }), 190);
  EXPECT_EQ(sum_in_parallel(), 190);
}

TEST(ThreadsPool, AForkInsideARegionIsRefusedInTheChild) {
  const pid_t parent = getpid();
  const auto caller = std::this_thread::get_id();
  std::atomic<int> tasks{0};
  std::atomic<bool> begun{false};
  int ended = 0;
  bool refused = false;
  try {
    parallel_for(2, 2, [&](int) {
      ++tasks;
      if (std::this_thread::get_id() != caller) {
        while (!begun) std::this_thread::yield();  // held by a worker, lost in the child
        return;
      }
      while (tasks < 2) std::this_thread::yield();
      const pid_t child = fork();
      if (child) waitpid(child, &ended, 0);
      begun = true;
    });
  } catch (const InputError&) {
    refused = true;
  }
  if (getpid() != parent) _exit(refused && sum_in_parallel() == 190 ? 7 : 1);
  EXPECT_FALSE(refused);
  EXPECT_TRUE(WIFEXITED(ended) && WEXITSTATUS(ended) == 7);
}
#endif

TEST(ThreadsPool, EnvironmentGivesTheDefault) {
  setenv("LINKWISE_THREADS", "5", 1);
  EXPECT_EQ(default_threads(), 5);
  for (const char* bad : {"0", "-2", "two", "3x", "99999"}) {
    setenv("LINKWISE_THREADS", bad, 1);
    EXPECT_THROW(default_threads(), InputError) << bad;
  }
  unsetenv("LINKWISE_THREADS");
}

}  // namespace
}  // namespace linkwise
