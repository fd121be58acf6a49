#include "flipfree/unwrap/chart/stretch.h"

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

Points2 corners_of(const mesh::Surface& surface, const Points2& uv) {
  Points2 corners(surface.faces.size(), 2);
  for (CornerId c = 0; c < corners.rows(); ++c) corners.row(c) = uv.row(surface.faces.data()[c]);
  return corners;
}

// A sheet with a peak, laid flat with the least mean.
struct Peak {
  mesh::Surface surface = test::grid(32, 32);
  Points2 uv;
  Stretch stretch;

  Peak() {
    for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
      const double x = 2.0 * surface.vertices(v, 0) / surface.vertices.col(0).maxCoeff() - 1.0;
      const double y = 2.0 * surface.vertices(v, 1) / surface.vertices.col(1).maxCoeff() - 1.0;
      surface.vertices.row(v) << x, y, 0.4 * std::exp(-6.0 * (x * x + y * y));
    }
    ExecutionContext context;
    Stats stats;
    uv = distortion::minimize_distortion(surface, surface.vertices.leftCols<2>(), {}, context,
                                         stats);
    stretch = stretch_of(surface, corners_of(surface, uv));
  }
};

TEST(Eased, the_most_stretched_places_give_way_as_far_as_the_mean_allows) {
  const Peak peak;
  ExecutionContext context;
  const Stretch most = {1.0 + 1.5 * (peak.stretch.energy - 1.0),
                        1.0 + 0.95 * (peak.stretch.ratio - 1.0)};
  for (const bool apart : {false, true}) {
    const Points2 uv = eased(peak.surface, peak.uv, most, apart, context);
    EXPECT_TRUE(stretch_of(peak.surface, corners_of(peak.surface, uv)).within(most));
  }
}

TEST(Eased, a_map_that_keeps_the_bound_or_cannot_stays_as_it_is) {
  const Peak peak;
  ExecutionContext context;
  for (const Stretch& most :
       {Stretch{2.0, 100.0}, Stretch{1.0 + 0.9 * (peak.stretch.energy - 1.0), 1.01},
        Stretch{2.0, 1.0 + 0.05 * (peak.stretch.ratio - 1.0)},
        Stretch{peak.stretch.energy, 1.0 + 0.95 * (peak.stretch.ratio - 1.0)}}) {
    EXPECT_EQ(eased(peak.surface, peak.uv, most, false, context), peak.uv);
  }
}

}  // namespace
}  // namespace flipfree::unwrap::stretch_test
