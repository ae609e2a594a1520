#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "error_of.hpp"
#include "linkwise/base/named.hpp"

namespace linkwise {
namespace {

struct Row {
  std::string_view name;
  int value;
};
constexpr Row table[] = {{"one", 1}, {"two", 2}};

TEST(Named, FindsTheRowItselfOrTellsWhichThereAre) {
  EXPECT_EQ(&find_named("number", "two", table), &table[1]);
  EXPECT_EQ(testing::error_of([] { find_named("number", "tow", table); }),
            "number 'tow' is unknown; known: one, two");
  EXPECT_EQ(testing::error_of([] { find_named("number", "", table, "auto"); }),
            "number '' is unknown; known: auto, one, two");
}

}  // namespace
}  // namespace linkwise
