#include "flipfree/mesh/refined/refined_map.h"

#include <gtest/gtest.h>

#include <array>

#include "support/shapes.h"

namespace flipfree::mesh::refined_map_test {
namespace {

TEST(CompactedMap, values_stay_with_their_vertices) {
  const Surface input = test::grid(3, 3);
  RefinedMap map{make_refined_surface(input), {}};
  RefinedSurface& surface = map.surface;
  // Two vertices are put into faces; the first goes again, with dead faces left behind.
  const auto split = [&](FaceId f) {
    const auto [a, b, c] = surface.mesh.corners(f);
    const auto support = [&](VertexId v) { return surface.support[static_cast<std::size_t>(v)]; };
    return surface.split_face(
        f, rounded_between(support(a), between(support(b), support(c), 0.5), 0.5));
  };
  const std::array<VertexId, 3> face = surface.mesh.corners(4);
  const VertexId gone = split(4);
  const VertexId stays = split(9);
  surface.mesh.replace(surface.mesh.star(gone),
                       std::array<EditableTriangulation::Triangle, 1>{face},
                       std::array<FaceId, 1>{4});
  map.uv.resize(surface.mesh.vertex_count(), 2);
  for (VertexId v = 0; v < map.uv.rows(); ++v)
    map.uv.row(v) = surface.position[static_cast<std::size_t>(v)].head<2>();

  const RefinedMap compact = compacted_map(map);
  ASSERT_EQ(compact.uv.rows(), 17);
  EXPECT_EQ(compact.surface.mesh.vertex_count(), 17);
  EXPECT_EQ(compact.uv.topRows(16), map.uv.topRows(16));
  EXPECT_EQ(compact.uv.row(16), map.uv.row(stays));
  EXPECT_EQ(compact.surface.position[16], surface.position[static_cast<std::size_t>(stays)]);
}

}  // namespace
}  // namespace flipfree::mesh::refined_map_test
