#include "flipfree/matchmaker/at_once/class_overlay.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::class_overlay_test {
namespace {

constexpr Index kSide = 30;

// Twelve vertices of a grid change places, inside the grid's own outline.
Constraints exchange(const mesh::RefinedMap& map) {
  Constraints constraints;
  for (const VertexId v : map.surface.boundary)
    constraints.outline.push_back(map.uv.row(v).transpose());
  for (Index i = 0; i < 12; ++i) {
    const auto vertex = [](Index k) { return (kSide + 1) * (4 + 7 * (k / 3)) + 5 + 9 * (k % 3); };
    constraints.pins.push_back(
        {vertex(i), map.uv.row(vertex((5 * i + 3) % 12)).transpose() + Vector2(0.0123, 0.0077)});
  }
  return constraints;
}

TEST(ClassOverlay, PinsThatChangePlacesArriveAllAtOnce) {
  const mesh::Surface surface = test::grid(kSide, kSide);
  mesh::RefinedMap map = test::identity_map(surface);
  const Constraints constraints = exchange(map);
  ExecutionContext context;
  Stats stats;
  ASSERT_TRUE(place_pins(map, constraints, context, stats));
  test::expect_valid(map);
  for (const PinnedVertex& p : constraints.pins)
    EXPECT_EQ(Vector2(map.uv.row(p.vertex).transpose()), p.uv);
  for (std::size_t i = 0; i < constraints.outline.size(); ++i)
    EXPECT_EQ(Vector2(map.uv.row(map.surface.boundary[i]).transpose()), constraints.outline[i]);
  EXPECT_GT(std::get<std::int64_t>(stats["plan.complexity"]), 0);
}

TEST(ClassOverlay, OutlinesThatAreNotConvexAreLeftToOthers) {
  mesh::Surface surface = test::grid(kSide, kSide);
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v)
    surface.vertices(v, 1) += 0.5 * surface.vertices(v, 0) * surface.vertices(v, 0);
  mesh::RefinedMap map = test::identity_map(surface);
  const Constraints constraints = exchange(map);
  const Points2 before = map.uv;
  ExecutionContext context;
  Stats stats;
  EXPECT_FALSE(place_pins(map, constraints, context, stats));
  EXPECT_EQ(map.uv, before);
}

}  // namespace
}  // namespace flipfree::matchmaker::class_overlay_test
