#include "flipfree/matchmaker/coarsening/coarsening_rounds.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::coarsening_rounds_test {
namespace {

constexpr Index kColumns = 12;

TEST(CoarsenInRounds, EndsWhenARoundIsIdleAndSaysHowManyThereWere) {
  const mesh::Surface surface = test::grid(kColumns, kColumns);
  const auto keep = static_cast<Index>(surface.vertices.rows());
  mesh::RefinedMap map = test::split_flat(surface, 40);
  ExecutionContext context;
  int relaxed = 0;
  const auto relax = [&] { return ++relaxed > 0; };
  EXPECT_EQ(coarsen_in_rounds(map, {}, keep, {12, 2, 1}, context, relax), relaxed);
  EXPECT_EQ(map.surface.mesh.vertex_count(), keep);
  EXPECT_EQ(coarsen_in_rounds(map, {}, keep, {12, 2, 1}, context, relax), 0);
  mesh::RefinedMap held = test::split_flat(surface, 3);
  EXPECT_EQ(coarsen_in_rounds(held, {keep, keep + 1, keep + 2}, keep, {12, 2, 1}, context, relax),
            0);
  EXPECT_EQ(held.surface.mesh.vertex_count(), keep + 3);
}

TEST(CoarsenInRounds, EndsWhereTheMapCannotBeRelaxed) {
  const mesh::Surface surface = test::grid(kColumns, kColumns);
  const auto keep = static_cast<Index>(surface.vertices.rows());
  mesh::RefinedMap map = test::split_flat(surface, 40);
  ExecutionContext context;
  EXPECT_EQ(coarsen_in_rounds(map, {}, keep, {}, context, [] { return false; }), 0);
  test::expect_valid(map);
}

}  // namespace
}  // namespace flipfree::matchmaker::coarsening_rounds_test
