#include "flipfree/matchmaker/request/polygon.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace flipfree::matchmaker::polygon_test {
namespace {

const Polygon kSquare = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

TEST(Polygon, TurningNumberOfSimplePolygonsIsOneByOrientation) {
  EXPECT_EQ(turning_number(kSquare), 1);
  Polygon clockwise = kSquare;
  std::reverse(clockwise.begin(), clockwise.end());
  EXPECT_EQ(turning_number(clockwise), -1);
}

TEST(Polygon, FigureEightTurnsZeroTimesAndDoubleLoopTwice) {
  EXPECT_EQ(turning_number({{0, 0}, {2, 2}, {2, 0}, {0, 2}}), 0);
  EXPECT_EQ(turning_number({{0, 0}, {4, 0}, {4, 4}, {-1, 4}, {-1, 1}, {3, 1}, {3, 3}, {0, 3}}), 2);
}

TEST(Polygon, TurningNumberDoesNotDependOnTheFirstCorner) {
  Polygon p = {{0, 0}, {4, 0}, {4, 4}, {-1, 4}, {-1, 1}, {3, 1}, {3, 3}, {0, 3}};
  for (std::size_t i = 0; i < p.size(); ++i) {
    std::rotate(p.begin(), p.begin() + 1, p.end());
    EXPECT_EQ(turning_number(p), 2);
  }
}

TEST(Polygon, SpikeIsTheTipOfASlit) {
  EXPECT_EQ(turning_number({{0, 0}, {0.5, 0.5}, {0, 0}, {1, 0}, {1, 1}, {0, 1}}), 1);
}

TEST(Polygon, ConflictsAreCrossingsTouchesAndRepeatedCorners) {
  EXPECT_FALSE(first_conflict(kSquare));
  EXPECT_TRUE(first_conflict({{0, 0}, {2, 2}, {2, 0}, {0, 2}}));
  EXPECT_TRUE(first_conflict({{0, 0}, {2, 0}, {2, 2}, {1, 0}, {0, 2}}));
  EXPECT_TRUE(first_conflict({{0, 0}, {1, 0}, {2, -1}, {2, 1}, {1, 0}, {0, 1}}));
}

TEST(Polygon, LocatesPointsExactly) {
  EXPECT_EQ(locate_in_polygon(kSquare, {0.5, 0.5}), 1);
  EXPECT_EQ(locate_in_polygon(kSquare, {1.0, 0.5}), 0);
  EXPECT_EQ(locate_in_polygon(kSquare, {1.0, 1.0}), 0);
  EXPECT_EQ(locate_in_polygon(kSquare, {1.0 + 0x1p-52, 0.5}), -1);
  EXPECT_EQ(locate_in_polygon({{0, 0}, {2, 0}, {1, 1}}, {1.5, 1.0}), -1);
}

}  // namespace
}  // namespace flipfree::matchmaker::polygon_test
