#include "flipfree/matchmaker/walk/walk_pins.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/matchmaker/at_once/planned_walk.h"
#include "flipfree/matchmaker/walk/coarse_walk.h"
#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker {
namespace {

void expect_arrived(const mesh::RefinedMap& map, const Constraints& constraints) {
  test::expect_valid(map);
  for (const PinnedVertex& p : constraints.pins)
    EXPECT_EQ(Vector2(map.uv.row(p.vertex).transpose()), p.uv) << p.vertex;
  for (std::size_t i = 0; i < constraints.outline.size(); ++i)
    EXPECT_EQ(Vector2(map.uv.row(map.surface.boundary[i]).transpose()), constraints.outline[i]);
}

Constraints boundary_as_it_is(const mesh::RefinedMap& map) {
  Constraints constraints;
  for (const VertexId v : map.surface.boundary)
    constraints.outline.emplace_back(map.uv.row(v).transpose());
  return constraints;
}

TEST(WalkPins, NearPinsComeTogetherAndAddNothing) {
  const mesh::Surface surface = test::grid(10, 10);
  mesh::RefinedMap map = test::identity_map(surface);
  Constraints constraints;
  constraints.pins = {{48, {0.45, 0.42}}, {72, {0.62, 0.58}}};
  ExecutionContext context;
  Stats stats;
  const Walk walk = walk_pins(map, constraints, true, context, stats);
  EXPECT_TRUE(walk.arrived);
  EXPECT_EQ(walk.mode, WalkMode::kTogether);
  EXPECT_EQ(map.surface.mesh.vertex_count(), surface.vertices.rows());
  expect_arrived(map, constraints);
}

TEST(WalkPins, WithoutPinsThereIsNothingToWalk) {
  const mesh::Surface surface = test::grid(4, 4);
  mesh::RefinedMap map = test::identity_map(surface);
  ExecutionContext context;
  Stats stats;
  const Walk walk = walk_pins(map, {}, true, context, stats);
  EXPECT_TRUE(walk.arrived);
  EXPECT_EQ(walk.mode, WalkMode::kNone);
}

// Two that change places inside a boundary that does not give way.
TEST(WalkPins, WithoutRefinementAWalkThatIsBlockedEndsWithAValidMap) {
  const mesh::Surface surface = test::warped_grid(8);
  mesh::RefinedMap map = test::identity_map(surface);
  Constraints constraints = boundary_as_it_is(map);
  constraints.pins = {{30, {0.75, 0.5}}, {50, {0.25, 0.375}}, {40, {0.3, 0.6}}, {41, {0.8, 0.2}}};
  ExecutionContext context;
  Stats stats;
  const Walk walk = walk_pins(map, constraints, false, context, stats);
  test::expect_valid(map);
  EXPECT_EQ(map.surface.mesh.vertex_count(), surface.vertices.rows());
  if (walk.arrived) expect_arrived(map, constraints);
  mesh::RefinedMap refined = test::identity_map(surface);
  EXPECT_TRUE(walk_pins(refined, constraints, true, context, stats).arrived);
  expect_arrived(refined, constraints);
}

TEST(PlannedWalk, IsNotForAFreeBoundaryAndLeavesTheMapAsItIs) {
  const mesh::Surface surface = test::warped_grid(8);
  mesh::RefinedMap map = test::identity_map(surface);
  Constraints constraints;
  constraints.pins = {{30, {0.5, 0.5}}};
  ExecutionContext context;
  Stats stats;
  EXPECT_FALSE(walk_as_planned(map, constraints, context, stats).arrived);
  EXPECT_EQ(map.uv, surface.vertices.leftCols(2));
}

TEST(PlannedWalk, BringsPinsThatChangePlacesHome) {
  const mesh::Surface surface = test::warped_grid(16);
  mesh::RefinedMap map = test::identity_map(surface);
  Constraints constraints = boundary_as_it_is(map);
  const auto vertex = [](Index k) { return 17 * (4 + 4 * (k / 3)) + 4 + 4 * (k % 3); };
  for (Index i = 0; i < 9; ++i) {
    constraints.pins.push_back(
        {vertex(i), map.uv.row(vertex((2 * i + 3) % 9)).transpose() + Vector2(0.0123, 0.0077)});
  }
  ExecutionContext context;
  Stats stats;
  ASSERT_TRUE(walk_as_planned(map, constraints, context, stats).arrived);
  expect_arrived(map, constraints);
}

TEST(CoarseWalk, IsForLargeSurfacesWithPinsAndWithoutLines) {
  const mesh::Surface small = test::grid(20, 20);
  const mesh::Surface large = test::grid(70, 70);
  Constraints constraints;
  constraints.pins = {{200, {0.5, 0.5}}};
  EXPECT_FALSE(has_coarse_levels(mesh::make_refined_surface(small), constraints));
  const mesh::RefinedSurface refined = mesh::make_refined_surface(large);
  EXPECT_TRUE(has_coarse_levels(refined, constraints));
  constraints.edges = {{200, 201}};
  EXPECT_FALSE(has_coarse_levels(refined, constraints));
  EXPECT_FALSE(has_coarse_levels(refined, {}));
}

TEST(CoarseWalk, CarriesTheFineMapAlong) {
  const mesh::Surface surface = test::grid(70, 70);
  mesh::RefinedMap map = test::identity_map(surface);
  Constraints constraints;
  constraints.pins = {{71 * 20 + 20, {0.6, 0.3}}, {71 * 50 + 50, {0.4, 0.8}}};
  ExecutionContext context;
  Stats stats;
  ASSERT_TRUE(walk_coarse_to_fine(map, constraints, context, stats));
  EXPECT_GE(std::get<std::int64_t>(stats.at("walk.levels")), 1);
  expect_arrived(map, constraints);
}

}  // namespace
}  // namespace flipfree::matchmaker
