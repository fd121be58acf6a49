#include "flipfree/matchmaker/unfold_wholes.h"

#include <gtest/gtest.h>

#include "flipfree/certify/winding.h"
#include "flipfree/matchmaker/untangle.h"
#include "matchmaker/pushed_map.h"
#include "support/shapes.h"

namespace flipfree {
namespace {

constexpr int kRounds = 6;

void expect_valid(const RefinedMap& map, const ExecutionContext& context) {
  map.surface.mesh.check_invariants();
  const Triangles faces = map.surface.mesh.faces();
  EXPECT_TRUE(find_flips(faces, map.uv, context).empty());
  Points2 corner_uv(faces.size(), 2);
  for (CornerId c = 0; c < faces.size(); ++c) corner_uv.row(c) = map.uv.row(faces.data()[c]);
  const EdgeFlags no_cuts(static_cast<std::size_t>(faces.size()), 0);
  EXPECT_TRUE(
      winding_failures(build_adjacency(map.surface.mesh.vertex_count(), faces), no_cuts, corner_uv)
          .empty());
}

TEST(UnfoldWholes, makes_room_for_the_faces_that_a_push_has_split) {
  const Surface surface = test::grid(20, 20);
  const VertexId v = 21 * 10 + 4;
  const auto keep = static_cast<Index>(surface.vertices.rows());
  ExecutionContext context;
  RefinedMap map = test::pushed(surface, v, context);
  const Index added = map.surface.mesh.vertex_count() - keep;
  ASSERT_GT(added, 10);
  const Points2 before = map.uv;
  const Index removed = unfold_wholes(map, {v}, keep, kRounds, context);
  EXPECT_EQ(map.surface.mesh.vertex_count(), keep + added - removed);
  EXPECT_GT(10 * removed, 9 * added);
  EXPECT_EQ(map.uv.row(v), before.row(v)) << "a held vertex has moved";
  expect_valid(map, context);
}

TEST(UnfoldWholes, leaves_a_map_alone_in_which_nothing_may_move) {
  const Surface surface = test::grid(20, 20);
  ExecutionContext context;
  RefinedMap map = test::pushed(surface, 21 * 10 + 4, context);
  const Points2 before = map.uv;
  std::vector<VertexId> all;
  for (VertexId w = 0; w < map.surface.mesh.vertex_count(); ++w) all.push_back(w);
  EXPECT_EQ(unfold_wholes(map, all, static_cast<Index>(surface.vertices.rows()), kRounds, context),
            0);
  EXPECT_EQ(map.uv, before);
}

}  // namespace
}  // namespace flipfree
