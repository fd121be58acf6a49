#include "flipfree/seamless/padding/reroute/turn_changes.h"

#include <gtest/gtest.h>

namespace flipfree::seamless::turn_changes_test {
namespace {

TEST(TurnChanges, TheLeastOneIsTheGreatestCommonDivisor) {
  EXPECT_EQ(least_change({4, 4, 4}), 0);
  EXPECT_EQ(least_change({4, 2, 6}), 2);
  EXPECT_EQ(least_change({1, 7}), 3);
  EXPECT_EQ(least_change({2, 7}), 1);
}

TEST(TurnChanges, ShortestSumsBeginWithWhatBringsThemNearer) {
  EXPECT_EQ(next_changes({3, 5, 4}, 3), (std::set<Index>{1}));
  EXPECT_EQ(next_changes({3, 6}, -3), (std::set<Index>{-2, -1}));
  // 1 = 3 + 3 - 5.
  EXPECT_EQ(next_changes({7, 9}, 1), (std::set<Index>{-5, 3}));
}

TEST(TurnChanges, AnySequenceOfThemEnds) {
  for (const Index wanted : {-17, -4, 1, 2, 9, 40}) {
    Index left = wanted;
    int steps = 0;
    for (; left != 0 && steps < 100; ++steps)
      left -= steps % 2 == 0 ? *next_changes({1, 11}, left).begin()
                             : *next_changes({1, 11}, left).rbegin();
    EXPECT_EQ(left, 0);
  }
}

}  // namespace
}  // namespace flipfree::seamless::turn_changes_test
