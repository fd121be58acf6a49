#include "flipfree/embedding/embed_surface.h"

#include <gtest/gtest.h>

#include <string>

#include "embedding/disks.h"
#include "flipfree/base/error.h"

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

}  // namespace
}  // namespace flipfree::embedding::embed_surface_test
