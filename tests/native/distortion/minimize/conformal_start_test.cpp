#include "flipfree/distortion/minimize/conformal_start.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/shapes.h"

namespace flipfree::distortion::conformal_start_test {
namespace {

TEST(SpectralConformalMap, of_a_flat_grid_is_a_similarity) {
  const mesh::Surface surface = test::grid(9, 7);
  // A start that is no similarity and has no symmetry.
  Points2 seed = surface.vertices.leftCols<2>();
  for (Eigen::Index v = 0; v < seed.rows(); ++v) seed(v, 0) += 0.3 * seed(v, 1) * seed(v, 1);
  ExecutionContext context;
  const Points2 uv = spectral_conformal_map(surface, seed, context);
  ASSERT_EQ(uv.rows(), surface.vertices.rows());
  const Vector2 x = uv.row(1) - uv.row(0);   // one cell along x: 1/9
  const Vector2 y = uv.row(10) - uv.row(0);  // one cell along y: 1/7
  EXPECT_NEAR(x.dot(y) / (x.norm() * y.norm()), 0.0, 1e-6);
  EXPECT_NEAR(9.0 * x.norm() / (7.0 * y.norm()), 1.0, 1e-6);
}

TEST(SpectralConformalMap, of_a_rolled_sheet_unrolls_it) {
  mesh::Surface surface = test::grid(40, 10);
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
    const double angle = 2.0 * surface.vertices(v, 0);
    const double y = surface.vertices(v, 1);
    surface.vertices.row(v) << 0.5 * std::cos(angle), 0.5 * std::sin(angle), y;
  }
  const Points2 seed = test::grid(40, 10).vertices.leftCols<2>();
  ExecutionContext context;
  const Points2 uv = spectral_conformal_map(surface, seed, context);
  ASSERT_EQ(uv.rows(), surface.vertices.rows());
  const double width = (uv.row(40) - uv.row(0)).norm();
  const double height = (uv.row(410) - uv.row(0)).norm();
  EXPECT_NEAR(width / height, 1.0, 1e-3);
}

}  // namespace
}  // namespace flipfree::distortion::conformal_start_test
