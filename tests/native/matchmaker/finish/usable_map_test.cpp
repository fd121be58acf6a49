#include "flipfree/matchmaker/finish/usable_map.h"

#include <gtest/gtest.h>

#include "flipfree/matchmaker/coarsening/relax.h"
#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::usable_map_test {
namespace {

const VertexId kPin = 21 * 10 + 4;

TEST(UsableMap, OptimisingLowersTheEnergyAndHoldsWhatIsHeld) {
  const mesh::Surface surface = test::bumpy_grid(10, 10, 0.3, 2);
  mesh::RefinedMap map = test::identity_map(surface);
  ExecutionContext context;
  Stats stats;
  const double before = energy_of(map, context);
  const Points2 there = map.uv;
  map.uv = optimise(map.surface, {0, 60}, map.uv, 20, false, context, stats);
  EXPECT_LT(energy_of(map, context), before);
  for (const VertexId v : {0, 60}) EXPECT_EQ(map.uv.row(v), there.row(v));
  test::expect_valid(map);
}

TEST(UsableMap, OptimisingIsOverWhenTimeIsAndKeepsTheMap) {
  const mesh::Surface surface = test::bumpy_grid(10, 10, 0.3, 2);
  const mesh::RefinedMap map = test::identity_map(surface);
  ExecutionContext context;
  context.clock = [now = 0.0]() mutable { return now += 1.0; };
  const TimeLimit limit(context, 0.5);
  Stats stats;
  EXPECT_EQ(optimise(map.surface, {0}, map.uv, 20, false, context, stats), map.uv);
  EXPECT_EQ(std::get<std::int64_t>(stats.at("time_limit_reached")), 1);
}

TEST(UsableMap, SeesABoundaryThatMeetsItself) {
  const mesh::Surface surface = test::grid(8, 1);
  mesh::RefinedMap map = test::identity_map(surface);
  EXPECT_FALSE(overlaps(map.surface, map.uv));
  for (Eigen::Index v = 0; v < map.uv.rows(); ++v) {
    const double angle = 8.0 * map.uv(v, 0);
    const double radius = 2 - 0.5 * map.uv(v, 1);
    map.uv.row(v) << radius * std::cos(angle), radius * std::sin(angle);
  }
  EXPECT_TRUE(overlaps(map.surface, map.uv));
}

TEST(UsableMap, IsCoarsenedToTheVerticesThatStay) {
  const mesh::Surface surface = test::grid(20, 20);
  const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  ExecutionContext context;
  Stats stats;
  const mesh::RefinedMap fine = test::drawn_out(surface, kPin, context);
  Constraints free;
  free.pins = {{kPin, fine.uv.row(kPin).transpose()}};
  const mesh::RefinedMap coarse = made_usable(fine, refined, free, false, context, stats);
  test::expect_valid(coarse);
  EXPECT_EQ(Vector2(coarse.uv.row(kPin).transpose()), free.pins.front().uv);
  Constraints held;
  for (const VertexId v : refined.boundary)
    held.outline.emplace_back(surface.vertices.row(v).head<2>().transpose());
  const mesh::RefinedMap flat = test::split_flat(surface, 30);
  const mesh::RefinedMap whole = made_usable(flat, refined, held, false, context, stats);
  EXPECT_EQ(whole.surface.mesh.vertex_count(), surface.vertices.rows());
  test::expect_valid(whole);
}

}  // namespace
}  // namespace flipfree::matchmaker::usable_map_test
