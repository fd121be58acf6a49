// Single measures of the certificate where whole certificates do not reach: degenerate surfaces,
// limits of what is named, provenance that is wrong in each possible way.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "flipfree/certify/certify.h"
#include "flipfree/certify/measures/energy.h"
#include "flipfree/certify/measures/provenance.h"
#include "flipfree/certify/measures/quarter_turns.h"
#include "flipfree/certify/measures/seamless.h"
#include "flipfree/certify/measures/winding.h"
#include "flipfree/certify/overlap/island_overlap.h"
#include "flipfree/certify/overlap/overlap.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify {
namespace {

using test::corners;
using test::flat;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

mesh::Adjacency adjacency_of(const mesh::Surface& surface) {
  return mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
}

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

TEST(Energy, of_flipped_maps_is_infinite_and_of_surfaces_without_area_not_a_number) {
  mesh::Surface surface = test::grid(2, 2);
  Points2 uv = flat(surface);
  uv.row(0).swap(uv.row(1));
  EXPECT_EQ(symmetric_dirichlet(surface, uv).maximum, kInfinite);
  surface.vertices.setZero();
  const EnergyFigures none = symmetric_dirichlet(surface, flat(test::grid(2, 2)));
  EXPECT_TRUE(std::isnan(none.mean));
  EXPECT_TRUE(std::isnan(none.percentile99));
}

TEST(Energy, leaves_faces_without_area_out_also_where_charts_are_named) {
  mesh::Surface surface = test::grid(2, 2);
  const Points2 uv = flat(surface);
  surface.vertices.row(surface.faces(0, 0)) = surface.vertices.row(surface.faces(0, 1)).eval();
  EXPECT_TRUE(std::isfinite(symmetric_dirichlet(surface, uv).mean));
  const mesh::Components charts = charts_of(adjacency_of(surface), mesh::EdgeFlags(24, 0));
  EXPECT_EQ(charts_above(surface, uv, charts, 1.0, 1e9).size(), 0U);
  EXPECT_EQ(charts_above(surface, uv, charts, 1.0, 0.0).size(), 1U);
}

// A triangle whose area is positive, and zero in doubles.
TEST(Energy, of_triangles_thinner_than_doubles_resolve_is_finite) {
  const mesh::Surface surface = loose_triangles(1);
  Points2 uv(3, 2);
  uv << 0, 0, std::nextafter(1.0, 0.0), 1, 1, std::nextafter(1.0, 2.0);
  const EnergyFigures figures = symmetric_dirichlet(surface, uv);
  EXPECT_GT(figures.mean, 1e10);
  EXPECT_LT(figures.maximum, kInfinite);
}

TEST(Winding, of_closed_surfaces_is_judged_at_every_uncut_vertex) {
  const mesh::Surface surface = test::tetrahedron();
  const mesh::Adjacency adjacency = adjacency_of(surface);
  Points2 uv(12, 2);
  for (Index f = 0; f < 4; ++f) uv.middleRows<3>(3 * f) << 0, 0, 1, 0, 0, 1;
  EXPECT_FALSE(winding_failures(adjacency, mesh::EdgeFlags(12, 0), uv).empty());
  EXPECT_TRUE(winding_failures(adjacency, mesh::EdgeFlags(12, 1), uv).empty());
}

TEST(Seams, only_cut_edges_with_two_sides_are_judged) {
  const mesh::Surface surface = test::grid(1, 1);
  const mesh::Adjacency adjacency = adjacency_of(surface);
  Points2 uv = flat(surface);
  EXPECT_TRUE(seam_failures(adjacency, mesh::EdgeFlags(6, 1), uv).empty());
  uv.bottomRows(3) *= 2.0;
  EXPECT_TRUE(seam_failures(adjacency, mesh::EdgeFlags(6, 0), uv).empty());
  EXPECT_EQ(seam_failures(adjacency, mesh::EdgeFlags(6, 1), uv).size(), 1U);
}

TEST(Seams, deviation_and_quarter_turn_are_those_of_the_nearest_turn) {
  const mesh::Surface surface = test::grid(1, 1);
  const mesh::Adjacency adjacency = adjacency_of(surface);
  Points2 uv = flat(surface);
  for (CornerId c = 3; c < 6; ++c) {
    const Vector2 p = uv.row(c);
    uv.row(c) << 4 - p.y(), 3 + p.x();
  }
  const auto exact = measure_seams(adjacency, mesh::EdgeFlags(6, 1), uv);
  ASSERT_EQ(exact.size(), 1U);
  EXPECT_EQ(exact[0].quarter_turns, 1);
  EXPECT_EQ(exact[0].translation, Vector2(4, 3));
  EXPECT_EQ(exact[0].deviation, 0.0);
  uv.bottomRows(3) *= 1.5;
  const auto scaled = measure_seams(adjacency, mesh::EdgeFlags(6, 1), uv);
  EXPECT_EQ(scaled[0].quarter_turns, 1);
  EXPECT_NEAR(scaled[0].deviation, 0.5 * std::sqrt(2.0), 1e-15);
}

TEST(QuarterTurns, of_a_tetrahedron_whose_corners_are_right_angles_or_half) {
  const mesh::Surface surface = test::tetrahedron();
  const mesh::Adjacency adjacency = adjacency_of(surface);
  // Every face a right triangle: only sums over whole turns are meaningful, but each corner enters
  // as many quadrants as the reference says: 1 at the right angle, and 1 or 0 at the others.
  Points2 uv(12, 2);
  for (Index f = 0; f < 4; ++f) uv.middleRows<3>(3 * f) << 0, 0, 1, 0, 0, 1;
  const auto turns = quarter_turns_around(adjacency, uv);
  Index sum = 0;
  for (const Index k : turns) sum += k;
  EXPECT_EQ(sum, 4 * 2);  // half a turn per triangle
}

TEST(QuarterTurns, are_four_inside_a_grid_and_not_counted_on_its_boundary) {
  const mesh::Surface surface = test::grid(3, 3);
  const Points2 plane = flat(surface);
  const double c = std::cos(0.3);
  const double s = std::sin(0.3);
  Points2 uv(plane.rows(), 2);
  uv.col(0) = c * plane.col(0) - s * plane.col(1);
  uv.col(1) = s * plane.col(0) + c * plane.col(1);
  const auto turns = quarter_turns_around(adjacency_of(surface), uv);
  for (VertexId v = 0; v < 16; ++v) {
    const bool inside = v % 4 > 0 && v % 4 < 3 && v / 4 > 0 && v / 4 < 3;
    EXPECT_EQ(turns[static_cast<std::size_t>(v)], inside ? 4 : kInvalid);
  }
}

TEST(Seams, both_coordinates_count_for_each_quarter_turn) {
  const mesh::Surface surface = test::grid(1, 1);
  const mesh::Adjacency adjacency = adjacency_of(surface);
  for (int turns = 0; turns < 4; ++turns) {
    Points2 uv = flat(surface);
    uv.col(1) *= 3.0;
    for (CornerId c = 3; c < 6; ++c) {
      for (int k = 0; k < turns; ++k) {
        const Vector2 p = uv.row(c);
        uv.row(c) << -p.y(), p.x();
      }
    }
    EXPECT_TRUE(seam_failures(adjacency, mesh::EdgeFlags(6, 1), uv).empty());
    for (const int axis : {0, 1}) {
      Points2 bent = uv;
      bent.bottomRows(3).col(axis) *= 2.0;
      EXPECT_EQ(seam_failures(adjacency, mesh::EdgeFlags(6, 1), bent).size(), 1U);
    }
  }
}

TEST(Overlap, names_at_most_a_thousand_faces) {
  // A strip of 700 cells folded onto the same 7 places over and over: thousands of contacts.
  const mesh::Surface surface = test::grid(700, 1);
  Points2 uv(surface.vertices.rows(), 2);
  for (VertexId v = 0; v < uv.rows(); ++v) {
    const double angle = 2.0 * 3.14159265358979 * (v % 701) / 7.0;
    const double radius = 2.0 - surface.vertices(v, 1);
    uv.row(v) << radius * std::cos(angle), radius * std::sin(angle);
  }
  const Overlaps overlaps = boundary_overlaps(surface.faces, adjacency_of(surface),
                                              mesh::EdgeFlags(3 * 1400, 0), corners(surface, uv));
  EXPECT_GT(overlaps.contacts, 1000);
  EXPECT_LE(overlaps.faces.size(), 1000U);
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

TEST(IslandOverlap, triangles_are_separated_by_a_side_of_either) {
  const mesh::Surface surface = loose_triangles(2);
  const mesh::Components charts = charts_of(adjacency_of(surface), mesh::EdgeFlags(6, 0));
  Points2 uv(6, 2);
  uv << 0, 0, 2, 0, 0, 2, 2, 2, 0.5, 1.9, 1.9, 0.5;  // a corner points at a long side
  EXPECT_EQ(island_overlaps(charts, uv).pairs, 0);
  const Points2 first = uv.topRows(3);
  uv.topRows(3) = uv.bottomRows(3).eval();
  uv.bottomRows(3) = first;
  EXPECT_EQ(island_overlaps(charts, uv).pairs, 0);
  uv.row(0) << 0, 0;
  EXPECT_EQ(island_overlaps(charts, uv).pairs, 1);
  uv.topRows(3) << 0, 0, 1, 1, 2, 2;  // it covers nothing
  EXPECT_EQ(island_overlaps(charts, uv).pairs, 0);
}

// The first chart is one triangle, the second a tree.
TEST(IslandOverlap, a_single_triangle_is_sought_on_both_sides_of_a_tree) {
  const mesh::Surface grid = test::grid(8, 8);
  const Eigen::Index m = grid.faces.rows();
  mesh::Components charts;
  charts.count = 2;
  charts.of_face.assign(static_cast<std::size_t>(m + 1), 1);
  charts.of_face[0] = 0;
  Points2 uv(3 * (m + 1), 2);
  uv.bottomRows(3 * m) = flat(grid);
  for (const double x : {0.01, 0.3, 0.6, 0.9}) {
    for (const double y : {0.01, 0.3, 0.6, 0.9}) {
      uv.topRows<3>() << x, y, x + 0.06, y, x, y + 0.06;
      EXPECT_EQ(island_overlaps(charts, uv).pairs, 1) << x << " " << y;
    }
  }
  uv.topRows<3>() << 0.9, -0.15, 1.2, -0.15, 1.2, 0.15;  // its box meets the grid's corner, it not
  EXPECT_EQ(island_overlaps(charts, uv).pairs, 0);
}

TEST(IslandOverlap, trees_of_many_triangles_are_searched_on_both_sides) {
  // Two combs of which only the last teeth meet, in either order.
  const mesh::Surface grid = test::grid(8, 8);
  const Eigen::Index n = grid.vertices.rows();
  const Eigen::Index m = grid.faces.rows();
  mesh::Surface surface;
  surface.vertices.resize(n + 3, 3);
  surface.vertices << grid.vertices, loose_triangles(1).vertices;
  surface.faces.resize(m + 1, 3);
  surface.faces.topRows(m) = grid.faces;
  surface.faces.row(m) << static_cast<Index>(n), static_cast<Index>(n + 1),
      static_cast<Index>(n + 2);
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

// A grid whose first face is split at its centroid, with what says where everything lies.
struct Refined {
  mesh::Surface parent = test::bumpy_grid(3, 3, 0.3, 2.0);
  mesh::Surface surface;
  std::vector<FaceId> parent_face;
  std::vector<FaceId> vertex_parent;
  Points3 weights;

  Refined() {
    const Eigen::Index n = parent.vertices.rows();
    const Eigen::Index m = parent.faces.rows();
    const Index a = parent.faces(0, 0), b = parent.faces(0, 1), c = parent.faces(0, 2);
    surface.vertices.resize(n + 1, 3);
    surface.vertices.topRows(n) = parent.vertices;
    surface.vertices.row(n) =
        (parent.vertices.row(a) + parent.vertices.row(b) + parent.vertices.row(c)) / 3.0;
    surface.faces.resize(m + 2, 3);
    surface.faces.topRows(m) = parent.faces;
    surface.faces.row(0) << a, b, static_cast<Index>(n);
    surface.faces.row(m) << b, c, static_cast<Index>(n);
    surface.faces.row(m + 1) << c, a, static_cast<Index>(n);
    for (FaceId f = 0; f < m; ++f) parent_face.push_back(f);
    parent_face.insert(parent_face.end(), {0, 0});
    vertex_parent.assign(static_cast<std::size_t>(n + 1), 0);
    weights = Points3::Zero(n + 1, 3);
    weights.row(n).setConstant(1.0 / 3.0);
  }
  ProvenanceReport check() const {
    return check_provenance(surface, {&parent, &parent_face, &vertex_parent, &weights});
  }
};

TEST(Provenance, says_in_which_way_it_is_wrong) {
  struct Wrong {
    const char* sentence;
    std::function<void(Refined&)> make;
  };
  const auto last = [](Refined& r) { return r.surface.vertices.rows() - 1; };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Wrong cases[] = {
      {"sizes", [](Refined& r) { r.parent_face.pop_back(); }},
      {"sizes", [](Refined& r) { r.vertex_parent.pop_back(); }},
      {"sizes", [](Refined& r) { r.weights.conservativeResize(2, 3); }},
      {"sizes", [](Refined& r) { r.parent.vertices.conservativeResize(40, 3); }},
      {"of the input was moved", [](Refined& r) { r.surface.vertices(3, 1) += 1e-15; }},
      {"no valid place", [](Refined& r) { r.vertex_parent.back() = -1; }},
      {"no valid place", [](Refined& r) { r.vertex_parent.back() = 18; }},
      {"no valid place", [&](Refined& r) { r.weights.row(last(r)) << -0.5, 0.5, 1.0; }},
      {"no valid place", [&](Refined& r) { r.weights.row(last(r)) << 0.5, 0.5, 0.5; }},
      {"no valid place", [&](Refined& r) { r.weights(last(r), 0) = nan; }},
      {"does not lie where", [&](Refined& r) { r.surface.vertices(last(r), 2) += 1e-3; }},
      {"does not lie where", [&](Refined& r) { r.surface.vertices(last(r), 2) = nan; }},
      {"has no parent", [](Refined& r) { r.parent_face.back() = -1; }},
      {"has no parent", [](Refined& r) { r.parent_face.back() = 18; }},
      {"leaves its parent", [](Refined& r) { r.parent_face.back() = 9; }},
      {"turned over", [](Refined& r) { std::swap(r.surface.faces(0, 0), r.surface.faces(0, 1)); }},
      {"not covered exactly once",
       [](Refined& r) {
         r.surface.faces.row(5) = r.surface.faces.row(4).eval();
         r.parent_face[5] = 4;
       }},
  };
  EXPECT_EQ(Refined().check().failures, 0);
  for (const Wrong& wrong : cases) {
    Refined refined;
    wrong.make(refined);
    const ProvenanceReport report = refined.check();
    EXPECT_GT(report.failures, 0) << wrong.sentence;
    EXPECT_NE(report.first.find(wrong.sentence), std::string::npos)
        << wrong.sentence << " / " << report.first;
  }
}

TEST(Provenance, vertices_of_neighbouring_faces_are_found_on_the_common_edge) {
  // A vertex on the edge between the first two faces belongs to one of them and is a corner of
  // triangles in both.
  mesh::Surface parent = test::grid(1, 1);
  mesh::Surface surface;
  surface.vertices.resize(5, 3);
  surface.vertices << parent.vertices, 0.5, 0.5, 0.0;
  surface.faces.resize(4, 3);
  // Faces are (0, 1, 3) and (0, 3, 2), the diagonal 0-3.
  surface.faces << 0, 1, 4, 1, 3, 4, 0, 4, 2, 4, 3, 2;
  const std::vector<FaceId> parent_face{0, 0, 1, 1};
  std::vector<FaceId> vertex_parent{0, 0, 1, 0, 0};
  Points3 weights = Points3::Zero(5, 3);
  weights.row(4) << 0.5, 0.0, 0.5;
  const Provenance provenance{&parent, &parent_face, &vertex_parent, &weights};
  EXPECT_EQ(check_provenance(surface, provenance).failures, 0);
  vertex_parent[4] = -1;
  EXPECT_GT(check_provenance(surface, provenance).failures, 0);
}

TEST(Provenance, at_most_a_thousand_faces_are_named) {
  Refined refined;
  refined.parent = test::grid(30, 30);
  refined.surface = refined.parent;
  refined.parent_face.assign(1800, -1);
  refined.vertex_parent.assign(961, 0);
  refined.weights = Points3::Zero(961, 3);
  const ProvenanceReport report = refined.check();
  EXPECT_EQ(report.faces.size(), 1000U);
  EXPECT_GE(report.failures, 1800);
}

}  // namespace
}  // namespace flipfree::certify
