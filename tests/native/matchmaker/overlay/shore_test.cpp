#include "flipfree/matchmaker/overlay/shore.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::shore_test {
namespace {

const Vector2 kCentre(0.47, 0.52);

double direction(const mesh::RefinedMap& map, VertexId v) {
  return angle_of(Vector2(map.uv.row(v).transpose()) - kCentre);
}

TEST(TurnFrom, isCounterClockwiseAndNeverZero) {
  EXPECT_DOUBLE_EQ(turn_from(0.5, 2.0), 1.5);
  EXPECT_DOUBLE_EQ(turn_from(2.0, 0.5), kTurn - 1.5);
  EXPECT_DOUBLE_EQ(turn_from(1.0, 1.0), kTurn);
}

TEST(Shore, HasAVertexNearTheMiddleOfAnyGap) {
  const mesh::Surface surface = test::grid(5, 5);
  mesh::RefinedMap map = test::identity_map(surface);
  Shore shore(map, kCentre);
  const Index before = map.surface.mesh.vertex_count();
  // Wide gaps have one among the grid's vertices.
  for (double from = -3; from < 3; from += 0.25) {
    const VertexId v = shore.between(from, 2.5);
    ASSERT_NE(v, kInvalid);
    EXPECT_TRUE(map.surface.mesh.is_boundary_vertex(v));
    EXPECT_NEAR(turn_from(from, direction(map, v)), 1.25, 0.3 * 2.5);
  }
  EXPECT_EQ(map.surface.mesh.vertex_count(), before);
  // Narrow ones get new ones, which are found again.
  for (double from = -3; from < 3; from += 0.25) {
    const double turn = 1e-3;
    const VertexId v = shore.between(from, turn);
    ASSERT_NE(v, kInvalid);
    EXPECT_GT(turn_from(from, direction(map, v)), 0.0);
    EXPECT_LT(turn_from(from, direction(map, v)), turn);
    EXPECT_EQ(shore.between(from, turn), v);
  }
  EXPECT_GT(map.surface.mesh.vertex_count(), before + 20);
  test::expect_valid(map);
}

TEST(Shore, ADirectionWithoutWidthHasNoVertex) {
  const mesh::Surface surface = test::grid(4, 4);
  mesh::RefinedMap map = test::identity_map(surface);
  Shore shore(map, kCentre);
  // From a corner of the grid itself: the vertex there is not strictly between.
  const VertexId corner = map.surface.boundary.front();
  const VertexId found = shore.between(direction(map, corner), 1e-18);
  EXPECT_NE(found, corner);
  test::expect_valid(map);
}

TEST(Shore, HalvesEdgesUntilEnoughVerticesLieBetweenTwo) {
  const mesh::Surface surface = test::grid(4, 4);
  mesh::RefinedMap map = test::identity_map(surface);
  Shore shore(map, kCentre);
  const std::vector<VertexId>& boundary = map.surface.boundary;
  const VertexId from = boundary[0], to = boundary[3];
  EXPECT_EQ(shore.inside(from, to, 2), (std::vector<VertexId>{boundary[1], boundary[2]}));
  for (const std::size_t count : {3U, 9U, 30U}) {
    const std::vector<VertexId> chain = shore.inside(from, to, count);
    ASSERT_GE(chain.size(), count);
    VertexId last = from;
    for (const VertexId v : chain) {
      EXPECT_LT(turn_from(direction(map, from), direction(map, v)),
                turn_from(direction(map, from), direction(map, to)));
      const HalfedgeId h = map.surface.mesh.find(last, v);
      ASSERT_NE(h, kInvalid);
      EXPECT_TRUE(map.surface.mesh.is_boundary(h));
      EXPECT_EQ(map.surface.mesh.source(h), last);
      last = v;
    }
  }
  test::expect_valid(map);
}

}  // namespace
}  // namespace flipfree::matchmaker::shore_test
