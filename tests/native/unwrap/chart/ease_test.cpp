#include "flipfree/unwrap/chart/ease.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/base/stats.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/unwrap/islands/stretch.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap {
namespace {

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

TEST(Ease, the_most_stretched_places_give_way_as_far_as_the_mean_allows) {
  const Peak peak;
  ExecutionContext context;
  const Stretch most = {1.0 + 1.5 * (peak.stretch.energy - 1.0),
                        1.0 + 0.95 * (peak.stretch.ratio - 1.0)};
  for (const bool apart : {false, true}) {
    const Points2 uv = eased(peak.surface, peak.uv, most, apart, context);
    EXPECT_TRUE(stretch_of(peak.surface, corners_of(peak.surface, uv)).within(most));
  }
}

TEST(Ease, a_map_that_keeps_the_bound_or_cannot_stays_as_it_is) {
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
}  // namespace flipfree::unwrap
