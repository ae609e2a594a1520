#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>

#include <gtest/gtest.h>

#include "linkwise/base/assert.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/base/memory.hpp"
#include "linkwise/base/outcome.hpp"

namespace linkwise {
namespace {

TEST(InputError, IsAnInvalidArgumentWithTheWholeMessage) {
  static_assert(std::is_base_of_v<std::invalid_argument, InputError>);
  try {
    throw InputError("joint 'elbow': axis has zero length; give a nonzero axis");
  } catch (const std::exception& error) {
    EXPECT_STREQ(error.what(), "joint 'elbow': axis has zero length; give a nonzero axis");
  }
}

TEST(Memory, WhatCannotFitIsRefusedWithTheEstimate) {
  EXPECT_GT(available_memory(), worth_a_check);
  EXPECT_NO_THROW(require_memory(worth_a_check, "little"));
  try {
    require_memory(3.0 * (1ull << 50), "a result of shape (7,)");
    FAIL();
  } catch (const std::bad_alloc& error) {
    EXPECT_EQ(std::string(error.what()).rfind("a result of shape (7,) needs about 3.15e+06 GiB", 0),
              0u)
        << error.what();
  }
}

#if LINKWISE_ASSERTIONS
TEST(AssertDeathTest, NamesFileConditionAndReason) {
  LINKWISE_ASSERT(1 + 1 == 2, "arithmetic");
  EXPECT_DEATH(LINKWISE_ASSERT(1 + 1 == 3, "arithmetic"),
               "test_base.cpp:.*1 \\+ 1 == 3 \\(arithmetic\\)");
}
#else
TEST(Assert, IsNotEvaluatedWhenSwitchedOff) {
  int calls = 0;
  const auto count = [&] { return ++calls > 100; };
  LINKWISE_ASSERT(count(), "never called");
  EXPECT_EQ(calls, 0);
}
#endif

TEST(Outcome, EachHasItsOwnWordAndRemedy) {
  std::set<std::string_view> names, messages;
  for (const OutcomeEntry& entry : outcome_table()) {
    EXPECT_EQ(to_string(entry.outcome), entry.name);
    names.insert(entry.name);
    messages.insert(message(entry.outcome));
    EXPECT_EQ(remedy(entry.outcome).empty(), entry.outcome == Outcome::converged);
    EXPECT_NE(describe(entry.outcome).find(remedy(entry.outcome)), std::string::npos);
  }
  EXPECT_EQ(names.size(), outcome_table().size());
  EXPECT_EQ(messages.size(), outcome_table().size());
}

}  // namespace
}  // namespace linkwise
