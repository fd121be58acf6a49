#include "flipfree/unwrap/seams/search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/base/stats.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::stretch_test {
namespace {

Points2 flat(const mesh::Surface& surface, double x, double y) {
  Points2 corners(surface.faces.size(), 2);
  for (CornerId c = 0; c < corners.rows(); ++c)
    corners.row(c) << x * surface.vertices(surface.faces.data()[c], 0),
        y * surface.vertices(surface.faces.data()[c], 1);
  return corners;
}

TEST(Stretch, is_none_at_any_scale_of_an_isometric_map) {
  const mesh::Surface sheet = test::grid(4, 5);
  const Stretch stretch = stretch_of(sheet, flat(sheet, 7.0, 7.0));
  EXPECT_NEAR(stretch.energy, 1.0, 1e-12);
  EXPECT_NEAR(stretch.ratio, 1.0, 1e-6);
}

TEST(Stretch, is_the_larger_factor_of_lengths_and_areas) {
  const mesh::Surface sheet = test::grid(10, 10);
  // Twice as wide: at the best scale longer and shorter by the square root of two, areas kept.
  const Stretch longer = stretch_of(sheet, flat(sheet, 2.0, 1.0));
  EXPECT_NEAR(longer.ratio, std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(longer.energy, certify::symmetric_dirichlet(sheet, flat(sheet, 2.0, 1.0)).mean,
              1e-12);
  // A narrow column of twice the width, a twentieth of all: areas there are twice as large.
  mesh::Surface squeezed = sheet;
  Points2 corners = flat(sheet, 1.0, 1.0);
  for (Eigen::Index v = 0; v < squeezed.vertices.rows(); ++v) {
    double& x = squeezed.vertices(v, 0);
    x = x > 0.15 ? x - 0.05 : (x > 0.05 ? 0.1 + 0.5 * (x - 0.1) : x);
  }
  const double width = squeezed.vertices.col(0).maxCoeff();
  EXPECT_LT(width, 1.0);
  EXPECT_GT(stretch_of(squeezed, corners).ratio, 1.8);
  EXPECT_LT(stretch_of(squeezed, corners).ratio, 2.2);
}

TEST(Stretch, of_less_than_a_hundredth_of_the_area_is_left_out) {
  mesh::Surface sheet = test::grid(20, 20);
  const Points2 corners = flat(sheet, 1.0, 1.0);
  sheet.vertices(0, 2) = 0.1;  // a corner: one or two of 800 triangles
  const Stretch stretch = stretch_of(sheet, corners);
  EXPECT_LT(stretch.ratio, 1.01);
  EXPECT_GT(stretch.energy, 1.0);
}

TEST(Stretch, of_a_flipped_map_is_infinite) {
  const mesh::Surface sheet = test::grid(3, 3);
  EXPECT_TRUE(std::isinf(stretch_of(sheet, flat(sheet, -1.0, 1.0)).energy));
  EXPECT_FALSE(stretch_of(sheet, flat(sheet, -1.0, 1.0)).within({1e300, 1e300}));
}

}  // namespace
}  // namespace flipfree::unwrap::stretch_test
