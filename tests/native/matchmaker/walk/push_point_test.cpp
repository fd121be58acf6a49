#include "flipfree/matchmaker/walk/push_point.h"

#include <gtest/gtest.h>

#include "flipfree/matchmaker/take_back/remove_added.h"
#include "flipfree/matchmaker/walk/corridor.h"
#include "flipfree/numeric/predicates.h"
#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker {
namespace {

TEST(PushPoint, ArrivesBitForBitAndMovesNothingOutsideTheCorridor) {
  const mesh::Surface surface = test::grid(20, 20);
  mesh::RefinedMap map = test::identity_map(surface);
  const VertexId v = 21 * 10 + 4;
  const Vector2 goal(0.7123, 0.5317);
  const Obstacles obstacles{{{0.45, 0.62}, {0.6, 0.4}}, {}, {}};
  const Vector2 from = map.uv.row(v).transpose();
  const Polygon corridor = corridor_around(from, goal, obstacles, 0.3, 0.8);
  ExecutionContext context;
  const std::vector<char> held(map.surface.position.size(), 0);
  EXPECT_FALSE(push_point(map, v, goal, corridor, held, 1, context)) << "limit ignored";
  EXPECT_EQ(map.uv, surface.vertices.leftCols(2));
  ASSERT_TRUE(push_point(map, v, goal, corridor, held, 5000, context));
  test::expect_valid(map);
  EXPECT_EQ(map.uv.row(v).transpose(), goal);
  for (VertexId w = 0; w < surface.vertices.rows(); ++w) {
    if (locate_in_polygon(corridor, surface.vertices.row(w).head<2>().transpose()) >= 0) continue;
    EXPECT_EQ(map.uv.row(w), surface.vertices.row(w).head<2>());
  }
}

TEST(PushPoint, SmallMoveInAFineMeshAddsNothing) {
  const mesh::Surface surface = test::grid(40, 40);
  mesh::RefinedMap map = test::identity_map(surface);
  const VertexId v = 41 * 20 + 20;
  const Vector2 from = map.uv.row(v).transpose();
  const Vector2 goal = from + Vector2(0.01, 0.003);
  const Polygon corridor = {from + Vector2(-0.3, -0.3), from + Vector2(0.3, -0.3),
                            from + Vector2(0.3, 0.3), from + Vector2(-0.3, 0.3)};
  ExecutionContext context;
  const std::vector<char> held(map.surface.position.size(), 0);
  ASSERT_TRUE(push_point(map, v, goal, corridor, held, 100, context));
  test::expect_valid(map);
  EXPECT_EQ(map.surface.mesh.vertex_count(), surface.vertices.rows());
}

TEST(PushPoint, RefusesToMoveAHeldVertexAndLeavesTheMapAlone) {
  const mesh::Surface surface = test::grid(20, 20);
  mesh::RefinedMap map = test::identity_map(surface);
  const VertexId v = 21 * 10 + 4;
  const Polygon corridor = {{0.05, 0.3}, {0.95, 0.3}, {0.95, 0.7}, {0.05, 0.7}};
  std::vector<char> held(map.surface.position.size(), 0);
  held[21 * 10 + 10] = 1;
  ExecutionContext context;
  const Points2 before = map.uv;
  EXPECT_FALSE(push_point(map, v, {0.8, 0.5}, corridor, held, 5000, context));
  EXPECT_EQ(map.uv, before);
  held[21 * 10 + 10] = 0;
  EXPECT_TRUE(push_point(map, v, {0.8, 0.5}, corridor, held, 5000, context));
}

TEST(PushPoint, RepeatedPushesAroundAHeldPointKeepTheMapValid) {
  const mesh::Surface surface = test::grid(12, 12);
  mesh::RefinedMap map = test::identity_map(surface);
  const VertexId v = 13 * 6 + 2;
  const Obstacles obstacles{{{0.5, 0.5}}, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {}};
  ExecutionContext context;
  std::vector<char> held;
  for (const Vector2& goal : {Vector2(0.5, 0.2), Vector2(0.8, 0.5), Vector2(0.5, 0.8),
                              Vector2(0.2, 0.5), Vector2(0.5, 0.25)}) {
    held.assign(map.surface.position.size(), 0);
    held[13 * 6 + 6] = 1;
    const Polygon corridor = corridor_around(map.uv.row(v).transpose(), goal, obstacles, 0.3, 0.8);
    ASSERT_TRUE(push_point(map, v, goal, corridor, held, 20000, context));
    test::expect_valid(map);
    EXPECT_EQ(map.uv.row(v).transpose(), goal);
    EXPECT_EQ(map.uv.row(13 * 6 + 6), surface.vertices.row(13 * 6 + 6).head<2>());
  }
  // Taking refinement back keeps it valid as well.
  const Index before = map.surface.mesh.vertex_count();
  const Index removed = remove_added(map, {13 * 6 + 2, 13 * 6 + 6},
                                     static_cast<Index>(surface.vertices.rows()), context);
  EXPECT_GT(removed, 0);
  EXPECT_EQ(map.surface.mesh.vertex_count(), before - removed);
  test::expect_valid(map);
}

TEST(Corridor, IsConvexAndClearOfObstacles) {
  const Obstacles obstacles{
      {{0.5, 0.52}, {0.3, 0.4}, {0.7, 0.45}, {0.1, 0.9}}, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {}};
  const Vector2 a(0.2, 0.5);
  const Vector2 b(0.8, 0.5);
  const Polygon corridor = corridor_around(a, b, obstacles, 1.0, 0.8);
  for (std::size_t i = 0; i < corridor.size(); ++i) {
    const Vector2& p = corridor[i];
    const Vector2& q = corridor[(i + 1) % corridor.size()];
    EXPECT_GT(numeric::orientation(p, q, a), 0);
    EXPECT_GT(numeric::orientation(p, q, b), 0);
    EXPECT_GE(locate_in_polygon(obstacles.outline, p), 0);
  }
  for (const Vector2& p : obstacles.points) EXPECT_LT(locate_in_polygon(corridor, p), 0);
}

TEST(Corridor, WayGoesThroughAWallOfPointsWithoutTouchingOne) {
  Obstacles obstacles;
  for (int i = 0; i < 19; ++i) obstacles.points.emplace_back(0.5, 0.04 * (i + 1));
  obstacles.outline = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  ExecutionContext context;
  const std::vector<Vector2> way = find_way({0.2, 0.3}, {0.8, 0.3}, obstacles, context);
  ASSERT_GE(way.size(), 2u);
  EXPECT_EQ(way.back(), Vector2(0.8, 0.3));
  Vector2 from(0.2, 0.3);
  for (const Vector2& p : way) {
    EXPECT_GT(clearance(from, p, obstacles), 0.015);
    from = p;
  }
  EXPECT_TRUE(find_way({0.2, 0.3}, {0.5, 0.04}, obstacles, context).empty()) << "target is taken";
  EXPECT_TRUE(find_way({0.2, 0.3}, {1.5, 0.3}, obstacles, context).empty()) << "target is outside";
}

}  // namespace
}  // namespace flipfree::matchmaker
