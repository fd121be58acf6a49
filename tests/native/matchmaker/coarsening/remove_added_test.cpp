#include "flipfree/matchmaker/coarsening/remove_added.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::remove_added_test {
namespace {

constexpr Index kColumns = 12;

TEST(ThinOut, TakesBackAllThatIsStraightButWhatIsHeld) {
  const mesh::Surface surface = test::grid(kColumns, kColumns);
  const auto keep = static_cast<Index>(surface.vertices.rows());
  mesh::RefinedMap map = test::split_flat(surface, 40);
  const VertexId held = keep + 5;
  const Vector2 place = map.uv.row(held).transpose();
  ExecutionContext context;
  EXPECT_GT(thin_out(map, {held}, keep, context), 0);
  while (thin_out(map, {keep}, keep, context) > 0) continue;
  EXPECT_EQ(map.surface.mesh.vertex_count(), keep + 1);
  EXPECT_EQ(map.uv.row(keep).transpose(), place) << "another than the held one is left";
  test::expect_valid(map);
}

}  // namespace
}  // namespace flipfree::matchmaker::remove_added_test
