#include "flipfree/matchmaker/coarsening/remove_vertex.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::remove_vertex_test {
namespace {

TEST(RemoveVertex, FillsTheStarOfAVertexThatLiesOnAnEdge) {
  const mesh::Surface surface = test::grid(4, 4);
  mesh::RefinedMap map = test::split_flat(surface, 1);
  const VertexId added = map.surface.mesh.vertex_count() - 1;
  VertexRemover remover(map);
  StarFilling filling;
  ASSERT_TRUE(remover.fill(added, filling));
  EXPECT_EQ(filling.star.size(), filling.triangles.size() + 2);
  EXPECT_EQ(filling.parents.size(), filling.triangles.size());
  EXPECT_TRUE(remover.remove(added));
  map = mesh::compacted_map(map);
  test::expect_valid(map);
  EXPECT_EQ(map.surface.mesh.vertex_count(), surface.vertices.rows());
  EXPECT_EQ(map.surface.mesh.faces().rows(), surface.faces.rows());
}

TEST(RemoveVertex, LeavesAVertexThatHoldsATrianglePositive) {
  const mesh::Surface surface = test::grid(4, 4);
  mesh::RefinedMap map = test::split_flat(surface, 1);
  const VertexId added = map.surface.mesh.vertex_count() - 1;
  // The corner of a triangle beyond the edge on which the added vertex lies: without that one the
  // triangle is turned over.
  const mesh::EditableTriangulation& mesh = map.surface.mesh;
  VertexId corner = kInvalid;
  mesh.for_each_outgoing(added, [&](HalfedgeId h) {
    const VertexId w = mesh.target(h);
    if (!mesh.is_boundary(w) && map.surface.support[static_cast<std::size_t>(added)].of(w) == 0.0)
      corner = w;
  });
  ASSERT_NE(corner, kInvalid);
  const Vector2 here = map.uv.row(corner).transpose();
  const Vector2 over = map.uv.row(added).transpose();
  map.uv.row(corner) = (here + 1.2 * (over - here)).transpose();
  map.uv.row(added) += 0.5 * (over - here).transpose();
  const Points2 before = map.uv;
  VertexRemover remover(map);
  EXPECT_FALSE(remover.remove(added));
  EXPECT_EQ(map.uv, before);
  StarFilling filling;
  EXPECT_TRUE(remover.fill(added, filling)) << "for those who untangle it afterwards";
}

}  // namespace
}  // namespace flipfree::matchmaker::remove_vertex_test
