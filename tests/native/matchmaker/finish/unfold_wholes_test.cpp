#include "flipfree/matchmaker/finish/unfold_wholes.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::unfold_wholes_test {
namespace {

TEST(UnfoldWholes, MakesRoomForTheFacesThatAPushHasSplit) {
  ExecutionContext context;
  auto [surface, v, keep, map] = test::drawn_out_square(context);
  const Index added = map.surface.mesh.vertex_count() - keep;
  ASSERT_GT(added, 10);
  const Points2 before = map.uv;
  const Index removed = unfold_wholes(map, {v}, keep, context);
  EXPECT_EQ(map.surface.mesh.vertex_count(), keep + added - removed);
  EXPECT_GT(10 * removed, 9 * added);
  EXPECT_EQ(map.uv.row(v), before.row(v)) << "a held vertex has moved";
  test::expect_valid(map);
}

TEST(UnfoldWholes, LeavesAMapAloneInWhichNothingMayMove) {
  ExecutionContext context;
  auto [surface, v, keep, map] = test::drawn_out_square(context);
  const Points2 before = map.uv;
  std::vector<VertexId> all;
  for (VertexId w = 0; w < map.surface.mesh.vertex_count(); ++w) all.push_back(w);
  EXPECT_EQ(unfold_wholes(map, all, keep, context), 0);
  EXPECT_EQ(map.uv, before);
}

}  // namespace
}  // namespace flipfree::matchmaker::unfold_wholes_test
