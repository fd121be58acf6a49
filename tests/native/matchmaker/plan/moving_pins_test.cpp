#include "flipfree/matchmaker/at_once/plan_motion.h"

#include <gtest/gtest.h>

namespace flipfree::matchmaker::moving_pins_test {
namespace {

const Polygon kRim = {{0, 0}, {4, 0.1}, {4.2, 4}, {0.1, 4.1}};
const std::vector<Vector2> kPins = {{1, 1.1}, {2.9, 1.2}, {1.1, 3}, {3, 2.9}, {2.05, 2.1}};

TEST(MovingPins, ArcsThatNothingHasPassedCrossNothing) {
  const MovingPins pins(kRim, kPins);
  ASSERT_TRUE(pins.valid());
  EXPECT_EQ(pins.complexity(), 0);
  Index along = 0;
  for (HalfedgeId h = 0; h < 3 * pins.face_count(); ++h) along += pins.along(h) ? 1 : 0;
  // 9 vertices, 4 of them on the rim: 3 * 9 - 3 - 4 edges, all but those of the rim are arcs.
  EXPECT_EQ(along, 2 * (20 - 4));
}

TEST(MovingPins, AWayBackUndoesTheWayThere) {
  MovingPins pins(kRim, kPins);
  ASSERT_TRUE(pins.move(0, {3.5, 2.2}));
  ASSERT_TRUE(pins.move(3, {0.7, 1.9}));
  EXPECT_GT(pins.complexity(), 0);
  ASSERT_TRUE(pins.move(3, kPins[3]));
  ASSERT_TRUE(pins.move(0, kPins[0]));
  EXPECT_EQ(pins.complexity(), 0);
  EXPECT_EQ(pins.place(0), kPins[0]);
}

TEST(MovingPins, ATriangleAroundNobodyLeavesTheClassAndOneAroundAPinChangesIt) {
  MovingPins pins(kRim, kPins);
  for (const Vector2& p : {Vector2(1.6, 0.6), Vector2(1.7, 1.2), kPins[0]})
    ASSERT_TRUE(pins.move(0, p));
  EXPECT_EQ(pins.complexity(), 0);
  for (const Vector2& p : {Vector2(3.1, 1.6), Vector2(1.6, 3), kPins[0]})
    ASSERT_TRUE(pins.move(0, p));  // around the fifth
  EXPECT_GT(pins.complexity(), 0);
  for (const Vector2& p : {Vector2(1.6, 3), Vector2(3.1, 1.6), kPins[0]})
    ASSERT_TRUE(pins.move(0, p));
  EXPECT_EQ(pins.complexity(), 0);
}

// A full twist of two pins is a Dehn twist: what crosses them crosses evenly more each time.
TEST(MovingPins, TwistsAddUpEvenly) {
  std::vector<std::int64_t> complexity;
  MovingPins pins(kRim, kPins);
  for (int i = 0; i < 6; ++i) {
    for (const Vector2& p : {Vector2(3.1, 1.6), Vector2(1.6, 3), kPins[0]})
      ASSERT_TRUE(pins.move(0, p));
    complexity.push_back(pins.complexity());
  }
  const std::int64_t step = complexity[2] - complexity[1];
  EXPECT_GT(step, 0);
  for (std::size_t i = 3; i < complexity.size(); ++i)
    EXPECT_EQ(complexity[i] - complexity[i - 1], step);
}

TEST(MovingPins, AMoveThroughAnotherPinIsRefused) {
  MovingPins pins(kRim, {{1, 1}, {2, 2}, {1, 3}});
  EXPECT_FALSE(pins.move(0, {3, 3}));
}

}  // namespace
}  // namespace flipfree::matchmaker::moving_pins_test
