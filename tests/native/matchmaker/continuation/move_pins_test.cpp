#include "flipfree/matchmaker/continuation/move_pins.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::move_pins_test {
namespace {

TEST(MovePins, NearPinsComeTogetherAndAddNothing) {
  const mesh::Surface surface = test::grid(10, 10);
  mesh::RefinedMap map = test::identity_map(surface);
  Constraints constraints;
  constraints.pins = {{48, {0.45, 0.42}}, {72, {0.62, 0.58}}};
  ExecutionContext context;
  Stats stats;
  const MovedPins move = move_pins(map, constraints, true, context, stats);
  EXPECT_TRUE(move.arrived);
  EXPECT_EQ(move.mode, MoveMode::kTogether);
  EXPECT_EQ(map.surface.mesh.vertex_count(), surface.vertices.rows());
  test::expect_arrived(map, constraints);
}

TEST(MovePins, WithoutPinsThereIsNothingToMove) {
  const mesh::Surface surface = test::grid(4, 4);
  mesh::RefinedMap map = test::identity_map(surface);
  ExecutionContext context;
  Stats stats;
  const MovedPins move = move_pins(map, {}, true, context, stats);
  EXPECT_TRUE(move.arrived);
  EXPECT_EQ(move.mode, MoveMode::kNone);
}

// Two that change places inside a boundary that does not give way.
TEST(MovePins, WithoutRefinementAMoveThatIsBlockedEndsWithAValidMap) {
  const mesh::Surface surface = test::warped_grid(8);
  mesh::RefinedMap map = test::identity_map(surface);
  Constraints constraints = test::boundary_as_it_is(map);
  constraints.pins = {{30, {0.75, 0.5}}, {50, {0.25, 0.375}}, {40, {0.3, 0.6}}, {41, {0.8, 0.2}}};
  ExecutionContext context;
  Stats stats;
  const MovedPins move = move_pins(map, constraints, false, context, stats);
  test::expect_valid(map);
  EXPECT_EQ(map.surface.mesh.vertex_count(), surface.vertices.rows());
  if (move.arrived) test::expect_arrived(map, constraints);
  mesh::RefinedMap refined = test::identity_map(surface);
  EXPECT_TRUE(move_pins(refined, constraints, true, context, stats).arrived);
  test::expect_arrived(refined, constraints);
}

}  // namespace
}  // namespace flipfree::matchmaker::move_pins_test
