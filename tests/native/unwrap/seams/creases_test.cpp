#include "flipfree/unwrap/seams/costs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::creases_test {
namespace {

std::ptrdiff_t edges_of(const mesh::Surface& surface, double price = 0.0) {
  const mesh::Adjacency adjacency = test::adjacency_of(surface);
  std::vector<double> cost = edge_costs(surface, adjacency, {}, {});
  if (price > 0.0) std::fill(cost.begin(), cost.end(), price);
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  const mesh::EdgeFlags flags = crease_seams(surface, adjacency, none, cost);
  return std::count(flags.begin(), flags.end(), 1) / 2;
}

// Rings (radius, height) of `sectors` vertices between two poles.
mesh::Surface turned(Index sectors, const std::vector<Vector2>& rings, double low, double high) {
  mesh::Surface surface = test::sphere(sectors, static_cast<Index>(rings.size()) + 1);
  VertexId pole[2] = {0, 0};
  for (VertexId v = 0; v < surface.vertices.rows(); ++v) {
    if (surface.vertices(v, 2) < surface.vertices(pole[0], 2)) pole[0] = v;
    if (surface.vertices(v, 2) > surface.vertices(pole[1], 2)) pole[1] = v;
  }
  for (VertexId v = 0; v < surface.vertices.rows(); ++v) {
    const double angle = std::acos(std::clamp(-surface.vertices(v, 2), -1.0, 1.0));
    const auto count = static_cast<double>(rings.size() + 1);
    const auto ring = static_cast<std::size_t>(std::lround(angle / std::numbers::pi * count));
    if (v == pole[0] || v == pole[1]) {
      surface.vertices.row(v) << 0, 0, v == pole[0] ? low : high;
      continue;
    }
    const double radius = surface.vertices.row(v).head<2>().norm();
    surface.vertices.row(v).head<2>() *= rings[ring - 1].x() / radius;
    surface.vertices(v, 2) = rings[ring - 1].y();
  }
  return surface;
}

TEST(Creases, a_cylinder_is_a_side_and_two_caps) {
  EXPECT_EQ(edges_of(turned(24, {{1, 0}, {1, 2}}, 0, 2)), 2 * 24);
}

TEST(Creases, a_cone_is_a_side_and_a_base) { EXPECT_EQ(edges_of(turned(24, {{1, 0}}, 0, 2)), 24); }

// One by three by one: of 20 unit edges nine stay together between the four long faces, two at the
// ends.
TEST(Creases, a_box_becomes_a_net) {
  const mesh::Surface plate = test::perforated_plate(0, 1);
  EXPECT_EQ(edges_of(plate), 9);
  EXPECT_EQ(edges_of(plate, std::numeric_limits<double>::infinity()), 0);
}

TEST(Creases, round_things_have_none) {
  EXPECT_EQ(edges_of(test::sphere(24, 12)), 0);
  EXPECT_EQ(edges_of(test::torus(24, 12)), 0);
}

}  // namespace
}  // namespace flipfree::unwrap::creases_test
