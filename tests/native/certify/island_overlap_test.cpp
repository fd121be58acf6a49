#include "flipfree/certify/overlap.h"

#include <gtest/gtest.h>

#include <limits>

#include "flipfree/certify/certify.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify::island_overlap_test {
namespace {

using test::adjacency_of;
using test::flat;
using test::measure;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Triangles apart from each other in space, all in one place in the plane.
mesh::Surface loose_triangles(Index count) {
  mesh::Surface surface;
  surface.vertices.resize(3 * count, 3);
  surface.faces.resize(count, 3);
  for (Index f = 0; f < count; ++f) {
    surface.vertices.middleRows<3>(3 * f) << f, 0, 0, f + 1, 0, 0, f, 1, 0;
    surface.faces.row(f) << 3 * f, 3 * f + 1, 3 * f + 2;
  }
  return surface;
}
Points2 stacked(Index count) {
  Points2 uv(3 * count, 2);
  for (Index f = 0; f < count; ++f) uv.middleRows<3>(3 * f) << 0, 0, 1, 0, 0, 1;
  return uv;
}

TEST(IslandOverlap, stacked_islands_are_counted_and_fail_only_if_they_must_be_disjoint) {
  const mesh::Surface one = test::grid(3, 3);
  const mesh::Surface surface = test::beside(one, one);
  const Points2 uv = flat(one).replicate(2, 1);
  const Certificate c = measure(surface, uv);
  EXPECT_TRUE(c.ok);
  EXPECT_EQ(c.overlaps, 0);
  EXPECT_EQ(c.island_overlaps, 1);
  EXPECT_EQ(c.island_overlap_faces.size(), 2U);
  CertifyRequest disjoint;
  disjoint.require_disjoint = true;
  EXPECT_FALSE(measure(surface, uv, disjoint).ok);
}

TEST(IslandOverlap, counting_ends_at_a_million_pairs_and_a_thousand_faces) {
  constexpr Index kTriangles = 1500;
  const mesh::Surface surface = loose_triangles(kTriangles);
  const mesh::Components charts = mesh::components_between(
      adjacency_of(surface), mesh::EdgeFlags(static_cast<std::size_t>(3 * kTriangles), 0));
  const IslandOverlaps overlaps = island_overlaps(charts, stacked(kTriangles));
  EXPECT_EQ(overlaps.pairs, IslandOverlaps::kMostPairs);
  EXPECT_EQ(overlaps.faces.size(), 1000U);
}

TEST(IslandOverlap, charts_that_cover_nothing_overlap_nothing) {
  const mesh::Surface surface = loose_triangles(4);
  const mesh::Components charts =
      mesh::components_between(adjacency_of(surface), mesh::EdgeFlags(12, 0));
  Points2 uv = stacked(4);
  uv.row(0).setConstant(std::numeric_limits<double>::quiet_NaN());
  uv.middleRows<3>(3).setConstant(kInfinite);
  uv.row(8) = uv.row(7);        // degenerate
  uv.row(10).swap(uv.row(11));  // flipped: covers what it covers
  EXPECT_EQ(island_overlaps(charts, uv).pairs, 0);
  uv.middleRows<3>(6) << 0, 0, 1, 0, 0, 1;
  EXPECT_EQ(island_overlaps(charts, uv).pairs, 1);
}

TEST(IslandOverlap, trees_of_many_triangles_are_searched_on_both_sides) {
  // Two combs of which only the last teeth meet, in either order.
  const mesh::Surface grid = test::grid(8, 8);
  const Eigen::Index m = grid.faces.rows();
  const mesh::Surface surface = test::beside(grid, loose_triangles(1));
  const mesh::Components charts = mesh::components_between(
      adjacency_of(surface), mesh::EdgeFlags(static_cast<std::size_t>(3 * (m + 1)), 0));
  for (const double x : {-0.05, 0.5, 0.99}) {
    for (const double y : {-0.05, 0.5, 0.99}) {
      Points2 uv(3 * (m + 1), 2);
      uv.topRows(3 * m) = flat(grid);
      uv.bottomRows<3>() << x, y, x + 0.06, y, x, y + 0.06;
      const bool apart = x < 0.0 && y < 0.0;  // its long side touches the corner, or passes it
      EXPECT_EQ(island_overlaps(charts, uv).pairs, apart ? 1 - (x + y + 0.06 < 0.0) : 1)
          << x << " " << y;
    }
  }
}

}  // namespace
}  // namespace flipfree::certify::island_overlap_test
