#include <stdexcept>
#include <string>
#include <type_traits>

#include <gtest/gtest.h>

#include "linkwise/base/assert.hpp"
#include "linkwise/base/error.hpp"

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

}  // namespace
}  // namespace linkwise
