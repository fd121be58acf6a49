#include "flipfree/matchmaker/coarsening/straighten.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker {
namespace {

constexpr Index kColumns = 12;

// Bends that are not needed go at once; those that hold a triangle positive stay.
TEST(Straighten, LaysFacesStraightThatCanBeWhole) {
  const mesh::Surface surface = test::grid(kColumns, kColumns);
  const auto keep = static_cast<Index>(surface.vertices.rows());
  mesh::RefinedMap map = test::split_flat(surface, 40);
  const Points2 straight = map.uv;
  test::bend(map, keep, 0.01);
  test::expect_valid(map);
  ASSERT_NE(map.uv, straight);
  ExecutionContext context;
  EXPECT_EQ(straighten(map, {}, keep, context), map.surface.mesh.vertex_count() - keep);
  EXPECT_LT((map.uv - straight).cwiseAbs().maxCoeff(), 1e-12);
  test::expect_valid(map);
}

TEST(Straighten, LeavesWhatIsHeldAndFacesThatWouldTurnOver) {
  const mesh::Surface surface = test::grid(kColumns, kColumns);
  const auto keep = static_cast<Index>(surface.vertices.rows());
  mesh::RefinedMap map = test::split_flat(surface, 40);
  test::bend(map, keep, 0.01);
  const VertexId held = keep + 7;
  const Vector2 place = map.uv.row(held).transpose();
  ExecutionContext context;
  EXPECT_LT(straighten(map, {held}, keep, context), 40);
  EXPECT_EQ(Vector2(map.uv.row(held).transpose()), place);
  for (VertexId v = 0; v < keep; ++v)
    EXPECT_EQ(Vector2(map.uv.row(v).transpose()),
              Vector2(surface.vertices.row(v).head<2>().transpose()));
  test::expect_valid(map);
}

}  // namespace
}  // namespace flipfree::matchmaker
