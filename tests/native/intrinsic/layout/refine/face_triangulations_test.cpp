#include "flipfree/intrinsic/layout/refine/face_triangulations.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "flipfree/base/plane.h"
#include "intrinsic/layout/refine/edge_points.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::face_triangulations_test {
namespace {

class FaceTriangulationsTest : public testing::Test {
 protected:
  FaceTriangulationsTest() : surface_(test::grid(2, 2)) {
    const mesh::Adjacency adjacency =
        mesh::build_adjacency(static_cast<Index>(surface_.vertices.rows()), surface_.faces);
    map_ = test::edge_points(surface_, adjacency, 2, [](const Vector2& p) { return p; });
  }
  mesh::Surface surface_;
  EdgePointMap map_;
};

TEST_F(FaceTriangulationsTest, AtFirstEveryFaceIsWhole) {
  const FaceTriangulations faces(surface_, map_);
  EXPECT_EQ(faces.face_count(), static_cast<std::size_t>(surface_.faces.rows()));
  for (std::size_t p = 0; p < map_.points.size(); ++p)
    EXPECT_FALSE(faces.uses(static_cast<std::int64_t>(p)));
  EXPECT_TRUE(faces.has_points(0));
  const RefinedLayout layout = faces.write(ExecutionContext());
  EXPECT_EQ(layout.surface.faces, surface_.faces);
  EXPECT_EQ(layout.uv, map_.corner_uv);
}

TEST_F(FaceTriangulationsTest, PolygonsHaveThePointsInUseInTheirOrder) {
  FaceTriangulations faces(surface_, map_);
  for (std::size_t p = 0; p < map_.points.size(); ++p)
    faces.use(static_cast<std::int64_t>(p), true);
  std::vector<PolygonVertex> polygon;
  faces.build_polygon(3, polygon);
  ASSERT_EQ(polygon.size(), 9U);
  double area = 0.0;
  for (std::size_t i = 0; i < 9; ++i) {
    const PolygonVertex& a = polygon[i];
    const PolygonVertex& b = polygon[(i + 1) % 9];
    area += 0.5 * (a.uv[0] * b.uv[1] - a.uv[1] * b.uv[0]);
    EXPECT_EQ(a.id < faces.vertex_count(), i % 3 == 0) << "corners, two points between";
    EXPECT_NE(a.sides & b.sides, 0) << "neighbours lie on one side";
  }
  EXPECT_NEAR(area, 0.125, 1e-14);
  faces.use(polygon[1].id - faces.vertex_count(), false);
  faces.build_polygon(3, polygon);
  EXPECT_EQ(polygon.size(), 8U);
}

TEST_F(FaceTriangulationsTest, WritesTrianglesWithProvenanceOfTheirOwnFace) {
  FaceTriangulations faces(surface_, map_);
  const FaceId f = 3;
  // A point of an edge that f shares with another face: both fan around it.
  Index edge = kInvalid;
  for (CornerId c = 3 * f; c < 3 * f + 3; ++c) {
    const Index e = map_.edge_of[static_cast<std::size_t>(c)];
    for (CornerId d = 0; d < static_cast<CornerId>(surface_.faces.size()); ++d)
      if (d / 3 != f && map_.edge_of[static_cast<std::size_t>(d)] == e) edge = e;
  }
  ASSERT_NE(edge, kInvalid);
  const std::int64_t p = map_.begin[static_cast<std::size_t>(edge)];
  faces.use(p, true);
  const Index id = faces.vertex_count() + static_cast<Index>(p);
  for (FaceId g = 0; g < static_cast<FaceId>(surface_.faces.rows()); ++g) {
    for (Index k = 0; k < 3; ++k) {
      if (map_.edge_of[static_cast<std::size_t>(3 * g + k)] != edge) continue;
      const VertexId a = surface_.faces(g, k), b = surface_.faces(g, (k + 1) % 3),
                     c = surface_.faces(g, (k + 2) % 3);
      faces.triangles(g) = {{a, id, c}, {id, b, c}};
    }
  }
  const RefinedLayout layout = faces.write(ExecutionContext());
  EXPECT_EQ(layout.surface.vertices.rows(), surface_.vertices.rows() + 1);
  EXPECT_EQ(layout.surface.faces.rows(), surface_.faces.rows() + 2);
  EXPECT_NE(layout.edge_vertex[static_cast<std::size_t>(p)], kInvalid);
  EXPECT_EQ(find_broken_invariant(surface_, layout), "");
}

}  // namespace
}  // namespace flipfree::intrinsic::face_triangulations_test
