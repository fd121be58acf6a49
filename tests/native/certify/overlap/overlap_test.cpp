#include "flipfree/certify/overlap/overlap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/certify/certify.h"
#include "flipfree/certify/overlap/island_overlap.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify {
namespace {

using test::corners;
using test::flat;
using test::measure;

CertifyRequest bijective() {
  CertifyRequest request;
  request.require_bijective = true;
  return request;
}

CertifyRequest disjoint() {
  CertifyRequest request;
  request.require_disjoint = true;
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
}

TEST(Overlap, a_slit_that_gapes_is_none) {
  const OpenedGrid grid = opened_grid(1.7, 2.3);
  const Certificate c = measure(grid.surface, grid.uv, bijective());
  EXPECT_EQ(c.overlaps, 0);
  EXPECT_TRUE(c.ok);
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

// Two copies of a grid, the second moved.
struct Pair {
  mesh::Surface surface;
  Points2 uv;
};
Pair two_grids(const Vector2& offset) {
  const mesh::Surface one = test::grid(3, 3);
  Pair pair;
  const Eigen::Index n = one.vertices.rows();
  const Eigen::Index m = one.faces.rows();
  pair.surface.vertices.resize(2 * n, 3);
  pair.surface.vertices << one.vertices, one.vertices;
  pair.surface.faces.resize(2 * m, 3);
  pair.surface.faces.topRows(m) = one.faces;
  pair.surface.faces.bottomRows(m) = one.faces.array() + static_cast<Index>(n);
  pair.uv.resize(6 * m, 2);
  pair.uv.topRows(3 * m) = flat(one);
  pair.uv.bottomRows(3 * m) = flat(one).rowwise() + offset.transpose();
  return pair;
}

TEST(IslandOverlap, stacked_islands_are_counted_and_fail_only_if_they_must_be_disjoint) {
  const Pair pair = two_grids(Vector2(0, 0));
  const Certificate c = measure(pair.surface, pair.uv);
  EXPECT_TRUE(c.ok);
  EXPECT_EQ(c.overlaps, 0);
  EXPECT_EQ(c.island_overlaps, 1);
  EXPECT_EQ(c.island_overlap_faces.size(), 2U);
  EXPECT_FALSE(measure(pair.surface, pair.uv, disjoint()).ok);
}

TEST(IslandOverlap, islands_that_touch_along_an_edge_or_in_a_corner_share_no_area) {
  const double width = test::grid(3, 3).vertices.col(0).maxCoeff();
  const double height = test::grid(3, 3).vertices.col(1).maxCoeff();
  for (const Vector2& offset : {Vector2(width, 0), Vector2(width, height), Vector2(3 * width, 0)}) {
    const Pair pair = two_grids(offset);
    EXPECT_EQ(measure(pair.surface, pair.uv).island_overlaps, 0);
  }
  const Pair closer = two_grids(Vector2(std::nextafter(width, 0.0), 0));
  EXPECT_EQ(measure(closer.surface, closer.uv).island_overlaps, 1);
}

TEST(IslandOverlap, an_island_in_the_hole_of_another_shares_no_area_and_one_inside_it_does) {
  // A 6 x 6 grid without its middle 2 x 2 squares, and a small triangle.
  const mesh::Surface full = test::grid(6, 6);
  const double unit = full.vertices.col(0).maxCoeff() / 6;
  std::vector<FaceId> kept;
  for (FaceId f = 0; f < full.faces.rows(); ++f) {
    Vector2 centre = Vector2::Zero();
    for (Index k = 0; k < 3; ++k)
      centre += full.vertices.row(full.faces(f, k)).head<2>().transpose() / (3 * unit);
    if (std::abs(centre.x() - 3) > 1 || std::abs(centre.y() - 3) > 1) kept.push_back(f);
  }
  mesh::Surface surface;
  const auto n = static_cast<VertexId>(full.vertices.rows());
  surface.vertices.resize(n + 3, 3);
  surface.vertices.topRows(n) = full.vertices;
  surface.vertices.bottomRows(3) << 0, 0, 0, 0.5 * unit, 0, 0, 0, 0.5 * unit, 0;
  surface.faces.resize(static_cast<Eigen::Index>(kept.size()) + 1, 3);
  for (std::size_t i = 0; i < kept.size(); ++i)
    surface.faces.row(static_cast<Eigen::Index>(i)) = full.faces.row(kept[i]);
  surface.faces.bottomRows(1) << n, n + 1, n + 2;
  for (const auto& [place, pairs] : {std::pair{3.0, 0}, std::pair{0.2, 1}, std::pair{-4.0, 0}}) {
    Points2 uv = flat(surface);
    uv.bottomRows(3).array() += place * unit;
    EXPECT_EQ(measure(surface, uv).island_overlaps, pairs) << place;
  }
}

TEST(IslandOverlap, many_stacked_islands_are_counted_up_to_a_bound) {
  mesh::Components charts;
  charts.count = 2000;
  Points2 uv(3 * 2000, 2);
  for (Index c = 0; c < charts.count; ++c) {
    charts.of_face.push_back(c);
    uv.middleRows(3 * c, 3) << 0, 0, 1, 0, 0, 1;
  }
  const IslandOverlaps found = island_overlaps(charts, uv);
  EXPECT_EQ(found.pairs, IslandOverlaps::kMostPairs);
  EXPECT_LE(found.faces.size(), 1000U);
}

TEST(Certify, a_map_with_a_hundredth_of_its_area_stretched_beyond_use_is_poor_and_names_the_chart) {
  const Pair pair = two_grids(Vector2(5, 0));
  Points2 uv = pair.uv;
  EXPECT_FALSE(measure(pair.surface, uv).poor);
  uv.bottomRows(uv.rows() / 2) *= 0.02;
  const Certificate c = measure(pair.surface, uv);
  EXPECT_TRUE(c.poor);
  EXPECT_GT(c.energy_p99, 25.0);
  ASSERT_FALSE(c.poor_islands.empty());
}

}  // namespace
}  // namespace flipfree::certify
