#include "flipfree/matchmaker/walk/corridor.h"

#include <gtest/gtest.h>

#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

const Vector2 kFrom(0, 0);
const Vector2 kTo(4, 0);

bool inside(const Polygon& polygon, const Vector2& p) { return locate_in_polygon(polygon, p) > 0; }

TEST(Corridor, HoldsTheLegAndNoObstacle) {
  Obstacles obstacles;
  obstacles.points = {{1, 0.5}, {2, -0.7}, {3, 0.2}, {-0.4, 0.1}};
  const Polygon corridor = corridor_around(kFrom, kTo, obstacles, 1.0, 0.8);
  EXPECT_TRUE(inside(corridor, kFrom));
  EXPECT_TRUE(inside(corridor, kTo));
  for (const Vector2& p : obstacles.points) EXPECT_FALSE(inside(corridor, p)) << p.transpose();
  for (std::size_t i = 0; i < corridor.size(); ++i) {
    EXPECT_GT(numeric::orientation(corridor[i], corridor[(i + 1) % corridor.size()],
                                   corridor[(i + 2) % corridor.size()]),
              0);
  }
}

TEST(FindWay, IsStraightWhereNothingIsInTheWay) {
  const ExecutionContext context;
  Obstacles obstacles;
  obstacles.points = {{2, 3}, {2, -3}};
  EXPECT_EQ(find_way(kFrom, kTo, obstacles, context), std::vector<Vector2>{kTo});
}

TEST(FindWay, PassesAnObstacleInItsWay) {
  const ExecutionContext context;
  Obstacles obstacles;
  obstacles.points = {{2, 0}, {2, 0.4}, {2, -3}, {0, 3}, {0, -3}, {4, 3}, {4, -3}};
  const std::vector<Vector2> way = find_way(kFrom, kTo, obstacles, context);
  ASSERT_FALSE(way.empty());
  EXPECT_EQ(way.back(), kTo);
  Vector2 here = kFrom;
  for (const Vector2& corner : way) {
    EXPECT_GT(clearance(here, corner, obstacles), 0);
    here = corner;
  }
}

TEST(FindWay, ThereIsNoneToAnObstacleOrOutOfTheOutline) {
  const ExecutionContext context;
  Obstacles obstacles;
  obstacles.points = {kTo};
  EXPECT_TRUE(find_way(kFrom, kTo, obstacles, context).empty());
  obstacles.points.clear();
  obstacles.outline = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  EXPECT_TRUE(find_way(kFrom, kTo, obstacles, context).empty());
  EXPECT_FALSE(find_way(kFrom, {0.5, 0.5}, obstacles, context).empty());
}

}  // namespace
}  // namespace flipfree::matchmaker
