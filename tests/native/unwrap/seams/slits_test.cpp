#include "flipfree/unwrap/seams/search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "flipfree/certify/measures.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/seams/costs.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::slits_test {
namespace {

Slits slits_of(const mesh::Surface& chart, const SlitOptions& options = {}) {
  const mesh::Adjacency adjacency = test::adjacency_of(chart);
  ExecutionContext context;
  return find_slits(chart, adjacency, edge_costs(chart, adjacency, {}, {}), options, context);
}

// Of the chart cut along the slits.
mesh::Topology shape_of(const mesh::Surface& chart, const Slits& slits) {
  const mesh::CutMesh cut = mesh::cut_along(chart.faces, test::adjacency_of(chart), slits.cut);
  return mesh::topology(
      cut.faces, mesh::build_adjacency(static_cast<Index>(cut.vertex_origin.size()), cut.faces));
}

TEST(Slits, a_flat_sheet_gets_none) {
  const Slits slits = slits_of(test::grid(5, 4));
  EXPECT_EQ(std::count(slits.cut.begin(), slits.cut.end(), 1), 0);
  EXPECT_EQ(slits.corner_uv.rows(), 3 * 40);
}

TEST(Slits, a_tube_with_two_rims_is_opened_along_its_length) {
  const mesh::Surface tube = test::cylinder(16, 3);
  const Slits slits = slits_of(tube);
  EXPECT_EQ(std::count(slits.cut.begin(), slits.cut.end(), 1), 2 * 3);
  EXPECT_TRUE(shape_of(tube, slits).is_disk());
}

TEST(Slits, closed_surfaces_are_opened_and_stay_within_the_bound) {
  for (const double bound : {1.01, 1.025, 1.1}) {
    const mesh::Surface ball = test::sphere(24, 12);
    SlitOptions options;
    options.bound = {bound, std::numeric_limits<double>::infinity()};
    const Slits slits = slits_of(ball, options);
    EXPECT_TRUE(shape_of(ball, slits).is_disk());
    ASSERT_EQ(slits.corner_uv.rows(), 3 * ball.faces.rows());
    EXPECT_LE(certify::symmetric_dirichlet(ball, slits.corner_uv).mean, bound);
  }
}

TEST(Slits, the_smallest_closed_surface_is_opened) {
  const mesh::Surface tetrahedron = test::tetrahedron();
  EXPECT_TRUE(shape_of(tetrahedron, slits_of(tetrahedron)).is_disk());
}

TEST(Slits, a_closed_surface_is_opened_also_where_no_slit_may_run) {
  const mesh::Surface ball = test::sphere(8, 6);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  const std::vector<double> cost(adjacency.opposite.size(),
                                 std::numeric_limits<double>::infinity());
  ExecutionContext context;
  EXPECT_TRUE(shape_of(ball, find_slits(ball, adjacency, cost, {}, context)).is_disk());
}

TEST(Slits, time_that_is_over_leaves_an_open_surface) {
  const mesh::Surface ball = test::sphere(24, 12);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  ExecutionContext context;
  double now = 0.0;
  context.clock = [&now] { return now += 1.0; };
  const TimeLimit limit(context, 1.5);
  EXPECT_TRUE(
      shape_of(ball, find_slits(ball, adjacency, edge_costs(ball, adjacency, {}, {}), {}, context))
          .is_disk());
}

}  // namespace
}  // namespace flipfree::unwrap::slits_test
