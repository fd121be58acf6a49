#include "flipfree/matchmaker/continuation/coarse_to_fine.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::coarse_to_fine_test {
namespace {

TEST(CoarseToFine, IsForLargeSurfacesWithPinsAndWithoutLines) {
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

TEST(CoarseToFine, CarriesTheFineMapAlong) {
  const mesh::Surface surface = test::grid(70, 70);
  mesh::RefinedMap map = test::identity_map(surface);
  Constraints constraints;
  constraints.pins = {{71 * 20 + 20, {0.6, 0.3}}, {71 * 50 + 50, {0.4, 0.8}}};
  ExecutionContext context;
  Stats stats;
  ASSERT_TRUE(move_coarse_to_fine(map, constraints, context, stats));
  EXPECT_GE(std::get<std::int64_t>(stats.at("continuation.levels")), 1);
  test::expect_arrived(map, constraints);
}

}  // namespace
}  // namespace flipfree::matchmaker::coarse_to_fine_test
