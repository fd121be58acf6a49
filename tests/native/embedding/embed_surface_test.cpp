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
