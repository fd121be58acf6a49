#include "flipfree/embedding/tutte/schnyder.h"

#include <gtest/gtest.h>

#include "embedding/disks.h"
#include "flipfree/embedding/tutte/tutte.h"

namespace flipfree::embedding::schnyder_test {
namespace {

// All faces but the outer one, drawn with the integer coordinates, are positive by exact
// arithmetic.
void expect_valid_drawing(const Triangles& faces, Index n, FaceId outer) {
  ExecutionContext context;
  const GridPoints grid = schnyder_drawing(faces, n, outer, context);
  EXPECT_GE(grid.minCoeff(), 0);
  EXPECT_LE(grid.maxCoeff(), n - 2);
  for (Index v = 0; v < n; ++v) ASSERT_EQ(grid.row(v).sum(), n - 1);
  for (FaceId f = 0; f < faces.rows(); ++f) {
    const auto x = [&](Index k) { return static_cast<std::int64_t>(grid(faces(f, k), 0)); };
    const auto y = [&](Index k) { return static_cast<std::int64_t>(grid(faces(f, k), 1)); };
    const std::int64_t twice = (x(1) - x(0)) * (y(2) - y(0)) - (y(1) - y(0)) * (x(2) - x(0));
    if (f == outer) {
      EXPECT_LT(twice, 0);
    } else {
      ASSERT_GT(twice, 0) << "face " << f;
    }
  }
}

TEST(Schnyder, IntegerDrawingIsValidForEveryOuterFace) {
  const mesh::Surface sphere = test::sphere(7, 5);
  for (FaceId outer = 0; outer < sphere.faces.rows(); ++outer) {
    expect_valid_drawing(sphere.faces, static_cast<Index>(sphere.vertices.rows()), outer);
  }
  const mesh::Surface tetrahedron = test::tetrahedron();
  for (FaceId outer = 0; outer < 4; ++outer) expect_valid_drawing(tetrahedron.faces, 4, outer);
}

TEST(Schnyder, IntegerDrawingIsValidForStackedTriangulations) {
  for (const auto stacking :
       {test::Stacking::kRandom, test::Stacking::kDeep, test::Stacking::kMixed}) {
    mesh::Surface surface = test::stacked(5000, stacking);
    surface.faces.conservativeResize(surface.faces.rows() + 1, 3);
    surface.faces.bottomRows(1) << 0, 2, 1;
    expect_valid_drawing(surface.faces, 5000, static_cast<Index>(surface.faces.rows()) - 1);
  }
}

}  // namespace
}  // namespace flipfree::embedding::schnyder_test
