#include "flipfree/matchmaker/at_once/move_as_planned.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::move_as_planned_test {
namespace {

TEST(MoveAsPlanned, IsNotForAFreeBoundaryAndLeavesTheMapAsItIs) {
  const mesh::Surface surface = test::warped_grid(8);
  mesh::RefinedMap map = test::identity_map(surface);
  Constraints constraints;
  constraints.pins = {{30, {0.5, 0.5}}};
  ExecutionContext context;
  Stats stats;
  EXPECT_FALSE(move_as_planned(map, constraints, context, stats).arrived);
  EXPECT_EQ(map.uv, surface.vertices.leftCols(2));
}

TEST(MoveAsPlanned, BringsPinsThatChangePlacesHome) {
  const mesh::Surface surface = test::warped_grid(16);
  mesh::RefinedMap map = test::identity_map(surface);
  Constraints constraints = test::boundary_as_it_is(map);
  const auto vertex = [](Index k) { return 17 * (4 + 4 * (k / 3)) + 4 + 4 * (k % 3); };
  for (Index i = 0; i < 9; ++i) {
    constraints.pins.push_back(
        {vertex(i), map.uv.row(vertex((2 * i + 3) % 9)).transpose() + Vector2(0.0123, 0.0077)});
  }
  ExecutionContext context;
  Stats stats;
  ASSERT_TRUE(move_as_planned(map, constraints, context, stats).arrived);
  test::expect_arrived(map, constraints);
}

}  // namespace
}  // namespace flipfree::matchmaker::move_as_planned_test
