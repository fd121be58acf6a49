#include "flipfree/matchmaker/coarsening/coarsen.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::coarsen_test {
namespace {

TEST(Coarsen, LeavesFewVerticesThatNothingNeedsAndHoldsWhatIsHeld) {
  ExecutionContext context;
  const test::DrawnOutSquare square = test::drawn_out_square(context);
  std::vector<VertexId> held = square.map.surface.boundary;
  held.push_back(square.moved);
  const Index added = square.map.surface.mesh.vertex_count() - square.keep;
  ASSERT_GT(added, 20);
  Index before = added;
  for (const double untangled : {0.0, 2.0}) {
    Stats stats;
    mesh::RefinedMap map = square.map;
    coarsen(map, held, square.keep, {.most_untangled = untangled}, context, stats);
    test::expect_valid(map);
    const Index left = map.surface.mesh.vertex_count() - square.keep;
    EXPECT_LE(left, before);
    before = left;
    for (const VertexId v : held) EXPECT_EQ(map.uv.row(v), square.map.uv.row(v));
    // The user's vertices are the first ones still.
    for (VertexId v = 0; v < square.keep; ++v)
      EXPECT_EQ(map.surface.support[static_cast<std::size_t>(v)].of(v), 1.0);
  }
  EXPECT_LT(2 * before, added);
}

TEST(Coarsen, WithNothingAddedChangesNothing) {
  const mesh::Surface surface = test::warped_grid(6);
  mesh::RefinedMap map = test::identity_map(surface);
  ExecutionContext context;
  Stats stats;
  coarsen(map, map.surface.boundary, map.surface.mesh.vertex_count(), {}, context, stats);
  EXPECT_EQ(map.uv, surface.vertices.leftCols(2));
}

TEST(Coarsen, OutOfTimeItEndsWithWhatItHas) {
  ExecutionContext context;
  test::DrawnOutSquare square = test::drawn_out_square(context);
  const Points2 before = square.map.uv;
  context.clock = [now = 0.0]() mutable { return now += 1.0; };
  const TimeLimit limit(context, 5);
  Stats stats;
  coarsen(square.map, {square.moved}, square.keep, {}, context, stats);
  EXPECT_EQ(std::get<std::int64_t>(stats.at("time_limit_reached")), 1);
  test::expect_valid(square.map);
  EXPECT_EQ(square.map.uv.row(square.moved), before.row(square.moved));
}

}  // namespace
}  // namespace flipfree::matchmaker::coarsen_test
