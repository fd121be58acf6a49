#include "flipfree/mesh/refined/curve_overlay.h"

#include <gtest/gtest.h>

#include "support/shapes.h"

namespace flipfree::mesh::curve_overlay_test {
namespace {

// Vertex of grid(columns, rows) in column i, row j.
VertexId at(Index columns, Index i, Index j) { return j * (columns + 1) + i; }

TEST(CurveOverlay, ParallelCurvesAddVerticesOnEdgesOfTheSurfaceOnly) {
  // Three quads with diagonals from lower left to upper right; one curve from the lower left to the
  // upper right corner, another above it. Cells between them would have diagonals to be crossed.
  const Surface surface = test::grid(3, 1);
  RefinedSurface refined = make_refined_surface(surface);
  CurveOverlay overlay(refined);
  const VertexId to = at(3, 3, 1);
  const VertexId p = overlay.cross(at(3, 0, 0), at(3, 1, 0), at(3, 1, 1), 7);
  const VertexId q = overlay.cross(p, at(3, 1, 0), at(3, 2, 1), 7);
  const VertexId r = overlay.cross(q, at(3, 2, 0), at(3, 2, 1), 7);
  ASSERT_TRUE(overlay.reach(r, to, 7));
  VertexId here = overlay.cross(at(3, 0, 1), at(3, 0, 0), at(3, 1, 1), 8);
  here = overlay.cross(here, p, at(3, 1, 1), 8);
  here = overlay.cross(here, q, at(3, 2, 1), 8);
  EXPECT_EQ(overlay.cross(here, p, q, 8), kInvalid) << "crosses the first curve";
  here = overlay.cross(here, r, at(3, 2, 1), 8);
  ASSERT_TRUE(overlay.reach(here, to, 8));
  const Index crossed = 7;
  overlay.finish();
  refined.mesh.check_invariants();
  EXPECT_EQ(refined.mesh.vertex_count(), surface.vertices.rows() + crossed);
  EXPECT_EQ(refined.mesh.faces().rows(), surface.faces.rows() + 2 * crossed);
  for (VertexId v = static_cast<VertexId>(surface.vertices.rows()); v <= here; ++v) {
    EXPECT_EQ(refined.support[static_cast<std::size_t>(v)].vertex[2], kInvalid)
        << "vertex " << v << " lies inside a face";
  }
  std::vector<FaceId> slots;
  const Triangles faces = refined.mesh.faces(&slots);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const FaceId parent = refined.mesh.parent(slots[static_cast<std::size_t>(f)]);
    ASSERT_LT(parent, surface.faces.rows());
    EXPECT_GT(refined.orientation_in_parent(parent, faces(f, 0), faces(f, 1), faces(f, 2)), 0);
  }
}

TEST(CurveOverlay, AnEdgeThatACurveRunsAlongIsNotCrossed) {
  const Surface surface = test::grid(2, 2);
  RefinedSurface refined = make_refined_surface(surface);
  CurveOverlay overlay(refined);
  const VertexId middle = at(2, 1, 1);
  ASSERT_TRUE(overlay.reach(at(2, 1, 0), middle, 1));
  EXPECT_FALSE(overlay.reach(at(2, 1, 0), middle, 2));
  EXPECT_EQ(overlay.cross(at(2, 0, 1), at(2, 1, 0), middle, 2), kInvalid);
  EXPECT_EQ(overlay.cross(at(2, 0, 0), at(2, 1, 0), middle, 2), kInvalid);
  EXPECT_EQ(refined.mesh.vertex_count(), surface.vertices.rows());
}

}  // namespace
}  // namespace flipfree::mesh::curve_overlay_test
