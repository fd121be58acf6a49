#include "flipfree/certify/overlap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "flipfree/certify/certify.h"
#include "fuzz/rational.h"
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

CertifyRequest disjoint() {
  CertifyRequest request;
  request.require_disjoint = true;
  return request;
}

// Charts of a few triangles each on a coarse grid, where much touches and much is degenerate: all
// pairs of triangles by clipping in rational numbers.
TEST(IslandOverlap, agrees_with_clipping_all_pairs_of_triangles_in_rational_numbers) {
  std::mt19937 random(4);
  std::int64_t total = 0, possible = 0;
  for (int round = 0; round < 150; ++round) {
    mesh::Components charts;
    charts.count = 2 + static_cast<Index>(random() % 5);
    const Index faces = charts.count * (1 + static_cast<Index>(random() % 12));
    Points2 uv(3 * faces, 2);
    std::vector<fuzz::Corners> exact;
    for (FaceId f = 0; f < faces; ++f) {
      charts.of_face.push_back(f % charts.count);
      const Vector2 place(random() % 12, random() % 12);
      fuzz::Corners corners;
      for (Index k = 0; k < 3; ++k) {
        uv.row(3 * f + k) = place + Vector2(random() % 4, random() % 4);
        // Off the grid, by so little that only exact arithmetic knows.
        if (random() % 4 == 0) uv(3 * f + k, 0) = std::nextafter(uv(3 * f + k, 0), kInfinite);
        corners[static_cast<std::size_t>(k)] = fuzz::exact(uv.row(3 * f + k).transpose());
      }
      exact.push_back(corners);
    }
    std::set<std::pair<Index, Index>> pairs;
    std::set<FaceId> sharing;
    for (FaceId f = 0; f < faces; ++f) {
      for (FaceId g = 0; g < f; ++g) {
        const Index a = charts.of_face[static_cast<std::size_t>(f)];
        const Index b = charts.of_face[static_cast<std::size_t>(g)];
        if (a == b || !fuzz::share_area(exact[static_cast<std::size_t>(f)],
                                        exact[static_cast<std::size_t>(g)]))
          continue;
        pairs.emplace(std::min(a, b), std::max(a, b));
        sharing.insert({f, g});
      }
    }
    const IslandOverlaps found = island_overlaps(charts, uv);
    EXPECT_EQ(found.pairs, static_cast<std::int64_t>(pairs.size()));
    EXPECT_TRUE(std::is_sorted(found.faces.begin(), found.faces.end()));
    std::set<Index> named;
    for (const FaceId f : found.faces) {
      EXPECT_TRUE(sharing.contains(f));
      named.insert(charts.of_face[static_cast<std::size_t>(f)]);
    }
    for (const auto& [a, b] : pairs) EXPECT_TRUE(named.contains(a) && named.contains(b));
    total += found.pairs;
    possible += charts.count * (charts.count - 1) / 2;
  }
  EXPECT_GT(total, possible / 5);
  EXPECT_LT(total, possible * 4 / 5);
}

// Two copies of a grid, the second moved.
struct Pair {
  mesh::Surface surface;
  Points2 uv;
};
Pair two_grids(const Vector2& offset) {
  const mesh::Surface one = test::grid(3, 3);
  Pair pair{test::beside(one, one), flat(one).replicate(2, 1)};
  pair.uv.bottomRows(3 * one.faces.rows()).rowwise() += offset.transpose();
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
  const mesh::Surface holed = test::faces_where(full, [&](FaceId f) {
    Vector2 centre = Vector2::Zero();
    for (Index k = 0; k < 3; ++k)
      centre += full.vertices.row(full.faces(f, k)).head<2>().transpose() / (3 * unit);
    return std::abs(centre.x() - 3) > 1 || std::abs(centre.y() - 3) > 1;
  });
  const mesh::Surface surface = test::beside(holed, loose_triangles(1));
  for (const auto& [place, pairs] : {std::pair{3.0, 0}, std::pair{0.2, 1}, std::pair{-4.0, 0}}) {
    Points2 uv = flat(surface);
    uv.bottomRows(3) << 0, 0, 0.5 * unit, 0, 0, 0.5 * unit;
    uv.bottomRows(3).array() += place * unit;
    EXPECT_EQ(measure(surface, uv).island_overlaps, pairs) << place;
  }
}

TEST(IslandOverlap, counting_ends_at_a_million_pairs_and_a_thousand_faces) {
  constexpr Index kTriangles = 1500;
  const mesh::Surface surface = loose_triangles(kTriangles);
  const mesh::Components charts = charts_of(
      adjacency_of(surface), mesh::EdgeFlags(static_cast<std::size_t>(3 * kTriangles), 0));
  const IslandOverlaps overlaps = island_overlaps(charts, stacked(kTriangles));
  EXPECT_EQ(overlaps.pairs, IslandOverlaps::kMostPairs);
  EXPECT_EQ(overlaps.faces.size(), 1000U);
}

TEST(IslandOverlap, charts_that_cover_nothing_overlap_nothing) {
  const mesh::Surface surface = loose_triangles(4);
  const mesh::Components charts = charts_of(adjacency_of(surface), mesh::EdgeFlags(12, 0));
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
  const mesh::Components charts =
      charts_of(adjacency_of(surface), mesh::EdgeFlags(static_cast<std::size_t>(3 * (m + 1)), 0));
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
