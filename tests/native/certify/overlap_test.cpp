#include "flipfree/certify/overlap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/certify/certify.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify::overlap_test {
namespace {

using test::adjacency_of;
using test::corners;
using test::flat;
using test::measure;

CertifyRequest bijective() {
  CertifyRequest request;
  request.require_bijective = true;
  return request;
}

// A flat 4 x 4 grid of unit squares, opened along the two edges left and right of its centre; the
// centre's copies of the faces below and above it are moved to these heights.
struct OpenedGrid {
  mesh::Surface surface = test::grid(4, 4);
  Points2 uv;
};
OpenedGrid opened_grid(double below, double above) {
  OpenedGrid grid;
  grid.surface.vertices *= 4.0 / grid.surface.vertices.leftCols<2>().maxCoeff();
  grid.uv = flat(grid.surface);
  for (CornerId c = 0; c < grid.uv.rows(); ++c) {
    if (grid.uv(c, 0) != 2.0 || grid.uv(c, 1) != 2.0) continue;
    double height = 0.0;
    for (Index k = 0; k < 3; ++k) height += grid.surface.vertices(grid.surface.faces(c / 3, k), 1);
    grid.uv(c, 1) = height < 6.0 ? below : above;
  }
  return grid;
}

TEST(Overlap, a_slit_whose_sides_are_moved_past_each_other_is_an_overlap) {
  const OpenedGrid grid = opened_grid(2.3, 1.7);
  const Certificate c = measure(grid.surface, grid.uv, bijective());
  EXPECT_EQ(c.flips64, 0);
  EXPECT_EQ(c.winding_failures, 0);
  EXPECT_EQ(c.overlaps, 1);
  EXPECT_FALSE(c.ok);
  EXPECT_FALSE(c.failed_faces.empty());
  const OpenedGrid gaping = opened_grid(1.7, 2.3);
  EXPECT_TRUE(measure(gaping.surface, gaping.uv, bijective()).ok);
}

TEST(Overlap, an_annulus_wound_twice_is_an_overlap_and_once_is_none) {
  const mesh::Surface strip = test::grid(40, 2);
  for (const double turns : {1.0, 2.0}) {
    // Glued into a ring: the last column's vertices become the first's.
    mesh::Surface ring;
    ring.vertices = strip.vertices;
    ring.faces = strip.faces;
    for (VertexId& v : ring.faces.reshaped()) v = v % 41 == 40 ? v - 40 : v;
    Points2 uv(strip.vertices.rows(), 2);
    for (VertexId v = 0; v < uv.rows(); ++v) {
      const double angle = 2.0 * std::numbers::pi * turns * (v % 41) / 40.0;
      const double radius = 2.0 - 0.5 * strip.vertices(v, 1);
      uv.row(v) << radius * std::cos(angle), radius * std::sin(angle);
    }
    const Certificate c = measure(ring, corners(ring, uv));
    EXPECT_EQ(c.flips64, 0);
    EXPECT_EQ(c.overlaps > 0, turns == 2.0);
  }
}

TEST(Overlap, sides_of_a_cut_that_become_equal_in_32_bits_are_joined_in_the_stored_map) {
  const OpenedGrid grid = opened_grid(2.0 - 1e-12, 2.0 + 1e-12);
  const Certificate c = measure(grid.surface, grid.uv, bijective());
  EXPECT_EQ(c.overlaps, 0);
  EXPECT_TRUE(c.ok);
}

TEST(Overlap, one_unit_in_the_last_place_decides) {
  OpenedGrid grid = opened_grid(2.0, 2.0);
  EXPECT_EQ(measure(grid.surface, grid.uv).overlaps, 0);
  const double step = std::nextafter(2.0, 3.0) - 2.0;
  EXPECT_EQ(measure(grid.surface, opened_grid(2.0, 2.0 + step).uv).overlaps, 0);
  EXPECT_EQ(measure(grid.surface, opened_grid(2.0 + step, 2.0).uv).overlaps, 1);
}

TEST(Overlap, names_at_most_a_thousand_faces_of_loops_turned_inside_out) {
  // A ring whose hole is turned inside out: its inner boundary runs outside the outer one. (The
  // triangles are flipped; the loops are simple all the same.)
  constexpr Index kColumns = 1200;
  mesh::Surface ring = test::grid(kColumns, 1);
  Points2 uv(ring.vertices.rows(), 2);
  for (VertexId v = 0; v < uv.rows(); ++v) {
    const Index column = v % (kColumns + 1) % kColumns;
    const double angle = 2.0 * 3.14159265358979 * column / kColumns;
    const double radius = v > kColumns ? 3.0 : 2.0;
    uv.row(v) << radius * std::cos(angle), radius * std::sin(angle);
  }
  for (VertexId& v : ring.faces.reshaped()) {
    if (v % (kColumns + 1) == kColumns) v -= kColumns;
  }
  Points2 mirrored = corners(ring, uv);
  // Both loops run counter-clockwise: one of them mirrored.
  for (CornerId c = 0; c < mirrored.rows(); ++c) {
    if (ring.faces(c / 3, c % 3) > kColumns) mirrored(c, 1) *= -1.0;
  }
  const Overlaps overlaps =
      boundary_overlaps(ring.faces, adjacency_of(ring), mesh::EdgeFlags(6 * kColumns, 0), mirrored);
  EXPECT_EQ(overlaps.contacts, 0);
  EXPECT_EQ(overlaps.turned_loops, 1);
  EXPECT_EQ(overlaps.faces.size(), 1000U);
}

}  // namespace
}  // namespace flipfree::certify::overlap_test
