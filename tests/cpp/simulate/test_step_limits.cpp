#include <limits>

#include <gtest/gtest.h>

#include "linkwise/simulate/step_limits.hpp"

namespace linkwise::test {
namespace {

using Kind = Breakpoints::Kind;

TEST(StepLimits, PassOneSmoothBreakpointAndNoOther) {
  const std::vector<Breakpoints> inputs{
      {{1, 2, 3, 4, 5}, {Kind::jump, Kind::smooth, Kind::smooth, Kind::kink, Kind::smooth}}};
  StepLimits limits(inputs, 0);
  EXPECT_EQ(limits.after(0.5), 1);
  EXPECT_EQ(limits.after(1), 3);
  EXPECT_EQ(limits.after(2.5), 4);
  EXPECT_EQ(limits.after(3), 4);
  EXPECT_EQ(limits.after(4), std::numeric_limits<double>::infinity());
  EXPECT_EQ(limits.after(0.5), 1);  // back again
}

TEST(StepLimits, AreThoseOfAllInputs) {
  const std::vector<Breakpoints> inputs{{{1, 4}, {Kind::jump, Kind::jump}},
                                        {{2, 3}, {Kind::smooth, Kind::smooth}}};
  StepLimits limits(inputs, 0);
  EXPECT_EQ(limits.after(0), 1);
  EXPECT_EQ(limits.after(1), 3);
  EXPECT_EQ(limits.after(2.5), 4);
}

TEST(StepLimits, KnowWhereTheMethodBeginsAnew) {
  const std::vector<Breakpoints> inputs{
      {{0, 1, 2, 3}, {Kind::jump, Kind::jump, Kind::kink, Kind::smooth}}};
  StepLimits limits(inputs, 0);
  EXPECT_FALSE(limits.breaks_at(0));  // the start is a beginning anyway
  EXPECT_TRUE(limits.breaks_at(1));
  EXPECT_FALSE(limits.breaks_at(1.5));
  EXPECT_FALSE(limits.breaks_at(2));
  EXPECT_FALSE(limits.breaks_at(3));
  EXPECT_TRUE(limits.breaks_at(1));
}

TEST(StepLimits, TakeTimesThatRoundingMayConfuseForOne) {
  const double twin = 1 + std::numeric_limits<double>::epsilon();
  const std::vector<Breakpoints> inputs{{{1, twin, 2}, {Kind::kink, Kind::jump, Kind::kink}}};
  StepLimits limits(inputs, 0);
  EXPECT_EQ(limits.after(0), 1);
  EXPECT_TRUE(limits.breaks_at(1));
  EXPECT_EQ(limits.after(1), 2);
}

}  // namespace
}  // namespace linkwise::test
