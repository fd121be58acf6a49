#include "flipfree/matchmaker/finish/ease.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::ease_test {
namespace {

Index eased(const test::DrawnOutSquare& square, Index enough) {
  ExecutionContext context;
  mesh::RefinedMap map = square.map;
  numeric::EliminationMemory order(square.keep);
  std::vector<VertexId> held = map.surface.boundary;
  held.push_back(square.moved);
  const Points2 before = map.uv;
  ease(map, held, square.keep, enough, order, context);
  test::expect_valid(map);
  for (const VertexId v : held) EXPECT_EQ(map.uv.row(v), before.row(v));
  // The user's vertices are the first ones still.
  for (VertexId v = 0; v < square.keep; ++v)
    EXPECT_EQ(map.surface.support[static_cast<std::size_t>(v)].of(v), 1.0);
  return map.surface.mesh.vertex_count() - square.keep;
}

TEST(Ease, FreesMostOfWhatAMoveLeftBehindAndHoldsWhatIsHeld) {
  ExecutionContext context;
  const test::DrawnOutSquare square = test::drawn_out_square(context);
  const Index added = square.map.surface.mesh.vertex_count() - square.keep;
  ASSERT_GT(added, 20);
  EXPECT_LT(2 * eased(square, 0), added);
}

TEST(Ease, WithNothingAddedChangesNothing) {
  const mesh::Surface surface = test::warped_grid(6);
  mesh::RefinedMap map = test::identity_map(surface);
  ExecutionContext context;
  numeric::EliminationMemory order(map.surface.mesh.vertex_count());
  ease(map, map.surface.boundary, map.surface.mesh.vertex_count(), 0, order, context);
  EXPECT_EQ(map.uv, surface.vertices.leftCols(2));
}

TEST(Ease, EndsSoonerWhereFewEnoughAreLeft) {
  ExecutionContext context;
  const test::DrawnOutSquare square = test::drawn_out_square(context);
  EXPECT_GE(eased(square, square.keep), eased(square, 0));
}

}  // namespace
}  // namespace flipfree::matchmaker::ease_test
