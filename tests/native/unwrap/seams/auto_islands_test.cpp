#include "flipfree/unwrap/seams/auto_islands.h"

#include <gtest/gtest.h>

#include "flipfree/certify/measures.h"
#include "flipfree/unwrap/seams/search.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::auto_islands_test {
namespace {

AutoIslands islands_of(const mesh::Surface& surface, const UnwrapOptions& options) {
  const mesh::Adjacency adjacency = test::adjacency_of(surface);
  ExecutionContext context;
  Stats stats;
  return find_islands(surface, surface.vertices, adjacency,
                      mesh::EdgeFlags(adjacency.opposite.size(), 0), {}, options, context, stats);
}

TEST(AutoIslands, are_flat_within_the_bound_whatever_the_topology) {
  for (const mesh::Surface& surface : {test::sphere(20, 12), test::torus(24, 12),
                                       test::cylinder(16, 4), test::perforated_plate(1, 3)}) {
    UnwrapOptions options;
    options.seams.stretch = 1.2;
    const AutoIslands found = islands_of(surface, options);
    ASSERT_EQ(found.uv.size(), found.islands.charts.size());
    for (std::size_t c = 0; c < found.uv.size(); ++c) {
      const mesh::Surface& chart = found.islands.charts[c].surface;
      Points2 corners(3 * chart.faces.rows(), 2);
      for (CornerId k = 0; k < corners.rows(); ++k)
        corners.row(k) = found.uv[c].row(chart.faces.data()[k]);
      EXPECT_TRUE(stretch_of(chart, corners).within(stretch_bound(1.2)));
      EXPECT_NEAR(certify::symmetric_dirichlet(chart, corners).scale, 1.0, 0.05);
    }
  }
}

TEST(AutoIslands, cut_along_sharp_edges_where_that_is_asked_for) {
  UnwrapOptions options;
  options.seams.sharp_angle = 1.0;
  // The top, the bottom, four sides outside and four in the hole.
  EXPECT_EQ(islands_of(test::perforated_plate(1, 2), options).islands.charts.size(), 10U);
}

}  // namespace
}  // namespace flipfree::unwrap::auto_islands_test
