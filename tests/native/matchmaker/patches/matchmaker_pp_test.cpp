#include "flipfree/matchmaker/patches/matchmaker_pp.h"

#include <gtest/gtest.h>

#include "flipfree/matchmaker/finish/usable_map.h"
#include "matchmaker/permuted_pins.h"
#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::matchmaker_pp_test {
namespace {

void expect_pins(const mesh::RefinedMap& map, const Constraints& constraints) {
  for (const PinnedVertex& pin : constraints.pins)
    EXPECT_EQ(Vector2(map.uv.row(pin.vertex).transpose()), pin.uv);
}

TEST(RunMatchmaker, MeetsPinsAndOutlineByAValidMapHoweverPinsArePermuted) {
  const mesh::Surface surface = test::warped_grid(10);
  const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  for (unsigned seed = 0; seed < 6; ++seed) {
    const Constraints constraints = test::permuted_pins(surface, refined, 3 + 2 * seed, seed);
    ExecutionContext context;
    Stats stats;
    const mesh::RefinedMap map = run_matchmaker(refined, constraints, context, stats);
    test::expect_valid(map);
    expect_pins(map, constraints);
    for (std::size_t i = 0; i < constraints.outline.size(); ++i)
      EXPECT_EQ(Vector2(map.uv.row(refined.boundary[i]).transpose()), constraints.outline[i]);
    EXPECT_EQ(std::get<std::int64_t>(stats.at("matchmaker.added_vertices")),
              map.surface.mesh.vertex_count() - surface.vertices.rows());
  }
}

TEST(RunMatchmaker, WithAFreeBoundaryTheMapIsOneToOne) {
  const mesh::Surface surface = test::warped_grid(10);
  const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  Constraints constraints = test::permuted_pins(surface, refined, 6, 4);
  constraints.outline.clear();
  ExecutionContext context;
  Stats stats;
  const mesh::RefinedMap map = run_matchmaker(refined, constraints, context, stats);
  test::expect_valid(map);
  expect_pins(map, constraints);
  EXPECT_FALSE(overlaps(map.surface, map.uv));
  EXPECT_EQ(map.surface.boundary, refined.boundary);
}

}  // namespace
}  // namespace flipfree::matchmaker::matchmaker_pp_test
