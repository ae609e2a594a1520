// What a user asks for and what it becomes: one place for numbers of threads, and for when they
// pay.
#include <cstdlib>
#include <optional>

#include <gtest/gtest.h>

#include "linkwise/base/error.hpp"
#include "linkwise/exec/executor.hpp"

namespace linkwise {
namespace {

/// LINKWISE_THREADS while it lives.
struct ThreadsVariable {
  explicit ThreadsVariable(const char* value) { setenv("LINKWISE_THREADS", value, 1); }
  ~ThreadsVariable() { unsetenv("LINKWISE_THREADS"); }
};

TEST(Executor, IsOneThreadUnlessAskedFor) {
  EXPECT_EQ(Executor().threads(), 1);
  EXPECT_EQ(Executor(), Executor(1));
  EXPECT_NE(Executor(), Executor(2));
}

TEST(Executor, ANumberIsTakenWhateverTheWork) {
  EXPECT_EQ(executor_for(3).threads(), 3);
  EXPECT_EQ(executor_for(3, 1).threads(), 3);
  for (const int bad : {-1, 0, max_threads + 1}) {
    EXPECT_THROW(executor_for(bad), InputError) << bad;
    EXPECT_THROW(executor_for(bad, 1), InputError) << bad;
  }
}

TEST(Executor, WithoutANumberItIsTheDefault) {
  EXPECT_GE(executor_for(std::nullopt).threads(), 1);
  const ThreadsVariable five("5");
  EXPECT_EQ(executor_for(std::nullopt).threads(), 5);
}

TEST(Executor, TheDefaultIsOneThreadWhereTheWorkPaysForNoMore) {
  const ThreadsVariable five("5");
  EXPECT_EQ(executor_for(std::nullopt, 511).threads(), 1);
  EXPECT_EQ(executor_for(std::nullopt, 512).threads(), 5);
  const ThreadsVariable bad("many");
  EXPECT_EQ(executor_for(std::nullopt, 511).threads(), 1);  // not looked up
  EXPECT_THROW(executor_for(std::nullopt, 512), InputError);
}

TEST(Executor, WorkThatDoesNotPayStaysOnTheCallingThread) {
  const Executor four(4);
  EXPECT_EQ(four.where_it_pays(Worth::region, 127).threads(), 1);
  EXPECT_EQ(four.where_it_pays(Worth::region, 128).threads(), 4);
  EXPECT_EQ(four.where_it_pays(Worth::call, 511).threads(), 1);
  EXPECT_EQ(four.where_it_pays(Worth::call, 512).threads(), 4);
}

}  // namespace
}  // namespace linkwise
