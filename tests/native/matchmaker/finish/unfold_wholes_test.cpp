#include "flipfree/matchmaker/finish/unfold_wholes.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker {
namespace {

constexpr int kRounds = 6;

TEST(UnfoldWholes, MakesRoomForTheFacesThatAPushHasSplit) {
  const mesh::Surface surface = test::grid(20, 20);
  const VertexId v = 21 * 10 + 4;
  const auto keep = static_cast<Index>(surface.vertices.rows());
  ExecutionContext context;
  mesh::RefinedMap map = test::drawn_out(surface, v, context);
  const Index added = map.surface.mesh.vertex_count() - keep;
  ASSERT_GT(added, 10);
  const Points2 before = map.uv;
  const Index removed = unfold_wholes(map, {v}, keep, kRounds, context);
  EXPECT_EQ(map.surface.mesh.vertex_count(), keep + added - removed);
  EXPECT_GT(10 * removed, 9 * added);
  EXPECT_EQ(map.uv.row(v), before.row(v)) << "a held vertex has moved";
  test::expect_valid(map);
}

TEST(UnfoldWholes, LeavesAMapAloneInWhichNothingMayMove) {
  const mesh::Surface surface = test::grid(20, 20);
  ExecutionContext context;
  mesh::RefinedMap map = test::drawn_out(surface, 21 * 10 + 4, context);
  const Points2 before = map.uv;
  std::vector<VertexId> all;
  for (VertexId w = 0; w < map.surface.mesh.vertex_count(); ++w) all.push_back(w);
  EXPECT_EQ(unfold_wholes(map, all, static_cast<Index>(surface.vertices.rows()), kRounds, context),
            0);
  EXPECT_EQ(map.uv, before);
}

}  // namespace
}  // namespace flipfree::matchmaker
