#include "flipfree/matchmaker/untangle_removal.h"

#include <gtest/gtest.h>

#include "flipfree/matchmaker/coarsen.h"
#include "flipfree/matchmaker/corridor.h"
#include "flipfree/matchmaker/push_point.h"
#include "flipfree/matchmaker/untangle.h"
#include "support/shapes.h"

namespace flipfree {
namespace {

// A vertex pushed through half of a grid, which leaves some hundred vertices behind, thinned out
// with everything else where it is.
RefinedMap pushed(const Surface& surface, VertexId v, ExecutionContext& context) {
  RefinedMap map{make_refined_surface(surface), surface.vertices.leftCols(2)};
  const Vector2 goal(0.7123, 0.5317);
  const Polygon corridor = corridor_around(map.uv.row(v).transpose(), goal,
                                           Obstacles{{{0.45, 0.62}, {0.6, 0.4}}, {}, {}}, 0.3, 0.8);
  const std::vector<char> held(map.surface.position.size(), 0);
  EXPECT_TRUE(push_point(map, v, goal, corridor, held, 5000, context));
  while (thin_out(map, {v}, static_cast<Index>(surface.vertices.rows()), context) > 0) continue;
  return map;
}

TEST(RemoveByUntangling, RemovesWhatThinningLeavesAndStaysValid) {
  const Surface surface = test::grid(20, 20);
  const VertexId v = 21 * 10 + 4;
  const auto keep = static_cast<Index>(surface.vertices.rows());
  ExecutionContext context;
  RefinedMap map = pushed(surface, v, context);
  const Index there = map.surface.mesh.vertex_count() - keep;
  ASSERT_GT(there, 10);
  const Points2 before = map.uv;
  const Index removed = remove_by_untangling(map, {v}, keep, context);
  EXPECT_GT(2 * removed, there);
  map = compacted_map(map);
  EXPECT_EQ(map.surface.mesh.vertex_count(), keep + there - removed);
  map.surface.mesh.check_invariants();
  std::vector<FaceId> slots;
  const Triangles faces = map.surface.mesh.faces(&slots);
  EXPECT_TRUE(find_flips(faces, map.uv, context).empty());
  EXPECT_TRUE(find_flips(faces, map.uv.cast<float>().cast<double>(), context).empty());
  for (FaceId f = 0; f < faces.rows(); ++f) {
    EXPECT_GT(map.surface.orientation_in_parent(
                  map.surface.mesh.parent(slots[static_cast<std::size_t>(f)]), faces(f, 0),
                  faces(f, 1), faces(f, 2)),
              0);
  }
  EXPECT_EQ(map.uv.row(v), before.row(v)) << "a held vertex has moved";
  for (const VertexId b : map.surface.boundary) EXPECT_EQ(map.uv.row(b), before.row(b));
}

TEST(RemoveByUntangling, LeavesHeldVerticesAndThoseBelowTheLimit) {
  const Surface surface = test::grid(20, 20);
  const VertexId v = 21 * 10 + 4;
  ExecutionContext context;
  RefinedMap map = pushed(surface, v, context);
  const Index count = map.surface.mesh.vertex_count();
  const Points2 before = map.uv;
  EXPECT_EQ(remove_by_untangling(map, {v}, count, context), 0);
  std::vector<VertexId> all;
  for (VertexId w = 0; w < count; ++w) all.push_back(w);
  EXPECT_EQ(remove_by_untangling(map, all, static_cast<Index>(surface.vertices.rows()), context),
            0);
  EXPECT_EQ(map.uv, before);
}

}  // namespace
}  // namespace flipfree
