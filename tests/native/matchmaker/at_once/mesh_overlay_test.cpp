#include "flipfree/matchmaker/at_once/mesh_overlay.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/numeric/predicates.h"
#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::mesh_overlay_test {
namespace {

// The boundary of the grid joined to four inner points, which are turned about the centre.
PlaneMap turned_square(const mesh::RefinedMap& map, double angle) {
  const auto& boundary = map.surface.boundary;
  const auto n = static_cast<Index>(boundary.size());
  PlaneMap plane;
  plane.before.resize(n + 4, 2);
  plane.vertex.assign(static_cast<std::size_t>(n + 4), kInvalid);
  Index first = 0;
  for (Index i = 0; i < n; ++i) {
    plane.vertex[static_cast<std::size_t>(i)] = boundary[static_cast<std::size_t>(i)];
    plane.before.row(i) = map.uv.row(boundary[static_cast<std::size_t>(i)]);
    if (plane.before.row(i).norm() == 0) first = i;
  }
  plane.after = plane.before;
  for (int k = 0; k < 4; ++k) {
    const double at = 0.013 + M_PI * (0.5 * k - 0.75);
    plane.before.row(n + k) << 0.5 + 0.3 * std::cos(at), 0.5 + 0.3 * std::sin(at);
    plane.after.row(n + k) << 0.5 + 0.2 * std::cos(at + angle), 0.5 + 0.2 * std::sin(at + angle);
  }
  std::vector<std::array<VertexId, 3>> faces = {{n, n + 1, n + 2}, {n, n + 2, n + 3}};
  const Index side = n / 4;
  for (Index k = 0; k < 4; ++k) {
    const auto outer = [&](Index i) { return (first + k * side + i) % n; };
    const Index next = n + (k + 1) % 4;
    for (Index i = 0; i < side; ++i) faces.push_back({n + k, outer(i), outer(i + 1)});
    faces.push_back({n + k, outer(side), next});
  }
  plane.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k)
      plane.faces(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(k)) = faces[f][k];
  }
  return plane;
}

TEST(MeshOverlay, TheMapIsFlipFreeAndMeetsThePlaneMapsVertices) {
  const mesh::Surface surface = test::grid(12, 12);
  mesh::RefinedMap map = test::identity_map(surface);
  const PlaneMap plane = turned_square(map, 0.7);
  ExecutionContext context;
  ASSERT_TRUE(follow_by(map, plane, context));
  test::expect_valid(map);
  const auto inserted = surface.vertices.rows();
  for (Eigen::Index k = 0; k < 4; ++k) {
    const Vector2 goal = plane.after.bottomRows(4).row(k).transpose();
    int met = 0;
    for (Eigen::Index v = inserted; v < inserted + 4; ++v)
      met += map.uv.row(v) == goal.transpose() ? 1 : 0;
    EXPECT_EQ(met, 1);
  }
  for (const VertexId v : map.surface.boundary)
    EXPECT_EQ(map.uv.row(v), surface.vertices.leftCols(2).row(v));
  // A vertex per crossing: the square's five edges and the spokes cross at most all of 3 x 12 rows.
  EXPECT_LT(map.surface.mesh.vertex_count(), inserted + 52 * 36);
}

// Corners on vertices and edges of the mesh, and edges through its vertices.
TEST(MeshOverlay, CoincidencesAreNoObstacle) {
  const mesh::Surface surface = test::grid(12, 12);
  mesh::RefinedMap map = test::identity_map(surface);
  PlaneMap plane = turned_square(map, 0.0);
  const Eigen::Index first = plane.before.rows() - 4;
  plane.before.row(first) << 0.25, 0.25;
  plane.before.row(first + 1) << 0.75, 0.26;
  plane.before.row(first + 2) << 0.75, 0.75;
  plane.before.row(first + 3) << 0.26, 0.74;
  plane.after.bottomRows(4) = plane.before.bottomRows(4);
  plane.after.row(first) << 0.31, 0.33;
  ExecutionContext context;
  ASSERT_TRUE(follow_by(map, plane, context));
  test::expect_valid(map);
  EXPECT_EQ(map.uv.row(13 * 3 + 3), plane.after.row(first));
}

TEST(MeshOverlay, WhatCannotBeFollowedChangesNothing) {
  const mesh::Surface surface = test::grid(12, 12);
  mesh::RefinedMap map = test::identity_map(surface);
  PlaneMap plane = turned_square(map, 0.7);
  plane.after.row(plane.after.rows() - 4) << 0.9, 0.9;  // folds
  ExecutionContext context;
  EXPECT_FALSE(follow_by(map, plane, context));
  EXPECT_EQ(map.uv, surface.vertices.leftCols(2));
  EXPECT_EQ(map.surface.mesh.vertex_count(), surface.vertices.rows());
}

TEST(MeshOverlay, PointsAreFoundInTheirFaces) {
  const mesh::Surface surface = test::grid(5, 3);
  Points2 points(3, 2);
  points << 0.31, 0.4, 2.0, 0.5, 0.9, 0.99;
  const std::vector<FaceId> face =
      locate_points(points, surface.faces, surface.vertices.leftCols(2));
  EXPECT_EQ(face[1], kInvalid);
  for (const Eigen::Index i : {Eigen::Index{0}, Eigen::Index{2}}) {
    ASSERT_NE(face[static_cast<std::size_t>(i)], kInvalid);
    for (Index k = 0; k < 3; ++k) {
      const auto corner = [&](Index c) -> Vector2 {
        return surface.vertices.row(surface.faces(face[static_cast<std::size_t>(i)], c % 3))
            .head(2)
            .transpose();
      };
      EXPECT_GE(numeric::orientation(corner(k), corner(k + 1), Vector2(points.row(i).transpose())),
                0);
    }
  }
}

TEST(LocatePoints, NoPointsAreNowhere) {
  const mesh::Surface surface = test::grid(2, 2);
  EXPECT_TRUE(locate_points(Points2(0, 2), surface.faces, surface.vertices.leftCols(2)).empty());
}

}  // namespace
}  // namespace flipfree::matchmaker::mesh_overlay_test
