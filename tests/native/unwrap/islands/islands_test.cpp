#include "flipfree/unwrap/islands/islands.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/mesh/topology.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::islands_test {
namespace {

using test::adjacency_of;

Islands islands_of(const mesh::Surface& surface, const mesh::EdgeFlags& seams,
                   bool extremities = false) {
  ExecutionContext context;
  return make_islands(surface, adjacency_of(surface), seams, {}, extremities, context);
}

mesh::EdgeFlags no_seams(const mesh::Surface& surface) {
  return mesh::EdgeFlags(static_cast<std::size_t>(surface.faces.size()), 0);
}

std::ptrdiff_t count(const mesh::EdgeFlags& flags) {
  return std::count(flags.begin(), flags.end(), 1);
}

// Every input face in one chart, every chart connected, planar and open.
void expect_flattenable(const Islands& islands, const mesh::Surface& surface) {
  std::vector<int> seen(static_cast<std::size_t>(surface.faces.rows()), 0);
  for (const mesh::Chart& chart : islands.charts) {
    for (const FaceId f : chart.faces) ++seen[static_cast<std::size_t>(f)];
    const mesh::Topology shape = mesh::topology(chart.surface.faces, adjacency_of(chart.surface));
    EXPECT_EQ(shape.genus(), 0);
    EXPECT_GE(shape.boundary_loops, 1);
  }
  EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](int times) { return times == 1; }));
}

TEST(Islands, an_open_piece_stays_as_its_seams_made_it) {
  const mesh::Surface cylinder = test::cylinder(12, 5);
  const Islands islands = islands_of(cylinder, no_seams(cylinder), true);
  ASSERT_EQ(islands.charts.size(), 1U);  // holes stay
  EXPECT_EQ(islands.opened, 0);
  EXPECT_EQ(count(islands.added), 0);
  expect_flattenable(islands, cylinder);
}

TEST(Islands, closed_pieces_and_handles_are_cut_until_they_are_planar) {
  for (const mesh::Surface& surface :
       {test::sphere(12, 8), test::torus(16, 12), test::tetrahedron()}) {
    const Islands islands = islands_of(surface, no_seams(surface));
    EXPECT_EQ(islands.charts.size(), 1U);
    EXPECT_EQ(islands.opened, 1);
    EXPECT_GT(count(islands.added), 0);
    EXPECT_EQ(count(islands.added), count(islands.cut));
    expect_flattenable(islands, surface);
  }
}

TEST(Islands, seams_part_a_surface_and_are_not_counted_as_added) {
  const mesh::Surface sphere = test::sphere(12, 8);
  const mesh::Adjacency adjacency = adjacency_of(sphere);
  // The ring of vertices nearest to the equator.
  const auto on_ring = [&](VertexId v) { return std::abs(sphere.vertices(v, 2)) < 1e-9; };
  mesh::EdgeFlags seams = no_seams(sphere);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(seams.size()); ++h) {
    if (on_ring(mesh::source(sphere.faces, h)) && on_ring(mesh::target(sphere.faces, h)))
      seams[static_cast<std::size_t>(h)] = 1;
  }
  ASSERT_EQ(count(seams), 2 * 12);
  const Islands islands = islands_of(sphere, seams);
  EXPECT_EQ(islands.charts.size(), 2U);
  EXPECT_EQ(islands.opened, 0);
  EXPECT_EQ(count(islands.added), 0);
  EXPECT_EQ(islands.cut, seams);
  expect_flattenable(islands, sphere);
}

TEST(Islands, a_seam_that_opens_nothing_parts_no_corner) {
  const mesh::Surface grid = test::grid(6, 6);
  const mesh::Adjacency adjacency = adjacency_of(grid);
  const auto inside = [&](VertexId v) {
    const Vector3 p = grid.vertices.row(v);
    return p.x() > 0.01 && p.x() < 0.99 && p.y() > 0.01 && p.y() < 0.99;
  };
  mesh::EdgeFlags seams = no_seams(grid);
  for (HalfedgeId h = 0; count(seams) == 0; ++h) {
    if (!inside(mesh::source(grid.faces, h)) || !inside(mesh::target(grid.faces, h))) continue;
    seams[static_cast<std::size_t>(h)] = 1;
    seams[static_cast<std::size_t>(adjacency.opposite[static_cast<std::size_t>(h)])] = 1;
  }
  ASSERT_EQ(count(seams), 2);
  const Islands islands = islands_of(grid, seams);
  ASSERT_EQ(islands.charts.size(), 1U);
  EXPECT_EQ(islands.charts[0].surface.vertices.rows(), grid.vertices.rows());
}

TEST(Islands, added_cuts_avoid_what_must_stay_whole) {
  const mesh::Surface sphere = test::sphere(12, 8);
  const mesh::Adjacency adjacency = adjacency_of(sphere);
  // The diagonals of the quadrilaterals that the sphere is made of: neither along a meridian nor
  // along a ring.
  mesh::EdgeFlags diagonals = no_seams(sphere);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(diagonals.size()); ++h) {
    const Vector3 a = sphere.vertices.row(mesh::source(sphere.faces, h));
    const Vector3 b = sphere.vertices.row(mesh::target(sphere.faces, h));
    const bool along_ring = std::abs(a.z() - b.z()) < 1e-9;
    const double turn = a.x() * b.y() - a.y() * b.x();
    if (!along_ring && std::abs(turn) > 1e-9) diagonals[static_cast<std::size_t>(h)] = 1;
  }
  ASSERT_EQ(count(diagonals), 2 * 12 * 6);
  ExecutionContext context;
  const Islands islands =
      make_islands(sphere, adjacency, no_seams(sphere), diagonals, true, context);
  for (std::size_t h = 0; h < diagonals.size(); ++h)
    EXPECT_FALSE(islands.cut[h] != 0 && diagonals[h] != 0) << "half-edge " << h;
  expect_flattenable(islands, sphere);
}

}  // namespace
}  // namespace flipfree::unwrap::islands_test
