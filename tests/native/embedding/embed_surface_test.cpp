#include "flipfree/embedding/embed_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "embedding/disks.h"
#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/embedding/tutte/tutte.h"

namespace flipfree::embedding::embed_surface_test {
namespace {

Error refusal(const Triangles& faces, Index vertices, const std::vector<VertexId>& loop,
              const Points2& boundary) {
  try {
    require_disk_with_boundary(faces, vertices, loop, boundary);
  } catch (const InvalidInput& e) {
    return e.error();
  }
  return {};
}

struct Case {
  test::Disk disk = test::make_disk(test::grid(4, 3), BoundaryShape::kCircle);
  Error refusal() const {
    return embed_surface_test::refusal(disk.surface.faces, disk.vertex_count(), disk.loop,
                                       disk.boundary);
  }
};

TEST(EmbedSurface, wrong_loops_are_named) {
  Case c;
  c.disk.boundary.conservativeResize(5, 2);
  EXPECT_EQ(c.refusal().code, ErrorCode::kBadBoundary);
  c = {};
  c.disk.loop[3] = 99;
  EXPECT_EQ(c.refusal().code, ErrorCode::kIndexOutOfRange);
  EXPECT_TRUE(c.refusal().elements.empty()) << "no vertex is to be shown";
  c = {};
  c.disk.loop[3] = c.disk.loop[1];
  EXPECT_EQ(c.refusal().code, ErrorCode::kBadBoundary);
  EXPECT_EQ(c.refusal().elements, std::vector<Index>{c.disk.loop[1]});
  c = {};
  std::swap(c.disk.loop[4], c.disk.loop[5]);
  EXPECT_EQ(c.refusal().code, ErrorCode::kBadBoundary);
  EXPECT_EQ(c.refusal().kind, ElementKind::kEdge);
  c = {};
  std::reverse(c.disk.loop.begin(), c.disk.loop.end());
  EXPECT_EQ(c.refusal().code, ErrorCode::kBadBoundary) << "the surface on the right";
}

TEST(EmbedSurface, other_topologies_are_refused) {
  // With one boundary loop each, or the loop of one of them.
  mesh::Surface handle = test::torus(6, 5);
  handle.faces.conservativeResize(handle.faces.rows() - 1, 3);
  const test::Disk holed = test::make_disk(handle, BoundaryShape::kTriangle);
  EXPECT_EQ(refusal(holed.surface.faces, 30, holed.loop, holed.boundary).code,
            ErrorCode::kNotADisk);
  const test::Disk tube = test::make_disk(test::cylinder(6, 2), BoundaryShape::kCircle);
  EXPECT_EQ(refusal(tube.surface.faces, 18, tube.loop, tube.boundary).code,
            ErrorCode::kBadBoundary);
  // A disk beside a torus: their Euler characteristics add up to that of a disk.
  const test::Disk disk = Case().disk;
  const mesh::Surface both = test::beside(disk.surface, test::torus(6, 5));
  EXPECT_EQ(refusal(both.faces, disk.vertex_count() + 30, disk.loop, disk.boundary).code,
            ErrorCode::kNotADisk);
}

// Strips without inner vertices: the circle has room for all their edges, evenly spaced points do
// not, and the cure that is named works.
TEST(EmbedSurface, long_strips_are_embedded_without_new_vertices) {
  for (const Index length : {1000, 100000}) {
    const mesh::Surface strip = test::grid(length, 1);
    EmbedSurfaceOptions options;
    ExecutionContext context;
    const certify::Parametrization map = embed_surface(strip, options, context);
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_EQ(map.surface.vertices.rows(), strip.vertices.rows());
    if (length < 100000) continue;
    options.loop = test::make_disk(strip, BoundaryShape::kCircle).loop;
    options.polygon = spread_on_circle(std::vector<double>(options.loop.size(), 1.0));
    try {
      embed_surface(strip, options, context);
      FAIL() << "a map was found";
    } catch (const NotConverged& e) {
      EXPECT_NE(e.error().message.find("Take the circle as the boundary"), std::string::npos);
      EXPECT_EQ(e.error().kind, ElementKind::kEdge);
    }
  }
}

// Triangles a few steps of the floats wide.
TEST(MakeStorable, repairs_what_rounding_would_flip_and_leaves_the_boundary) {
  const test::Disk disk = test::make_disk(test::grid(14, 14), BoundaryShape::kSquare);
  ExecutionContext context;
  Points2 uv =
      tutte_uniform(disk.surface.faces, disk.vertex_count(), disk.loop, disk.boundary, context);
  // Drawn together around a corner, where the floats stay as coarse.
  for (VertexId v = 0; v < uv.rows(); ++v) {
    if (std::find(disk.loop.begin(), disk.loop.end(), v) != disk.loop.end()) continue;
    uv.row(v) = Eigen::RowVector2d(0.7, 0.6) + 3e-7 * uv.row(v);
  }
  EXPECT_TRUE(distortion::is_flip_free(disk.surface.faces, uv, context));
  ASSERT_FALSE(distortion::is_flip_free(disk.surface.faces, as_stored(uv), context));
  const Points2 before = uv;
  Stats stats;
  ASSERT_TRUE(make_storable(disk.surface.faces, disk.loop, uv, context, stats));
  EXPECT_TRUE(distortion::is_flip_free(disk.surface.faces, uv, context));
  EXPECT_TRUE(distortion::is_flip_free(disk.surface.faces, as_stored(uv), context));
  for (const VertexId v : disk.loop) EXPECT_EQ(uv.row(v), before.row(v));
}

}  // namespace
}  // namespace flipfree::embedding::embed_surface_test
