#include "flipfree/unwrap/seams/nets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flipfree/unwrap/seams/costs.h"
#include "support/shapes.h"

namespace flipfree::unwrap::nets_test {
namespace {

mesh::EdgeFlags nets_of(const mesh::Surface& surface) {
  const std::vector<double> cost = edge_costs(surface, {}, {});
  return net_seams(surface, mesh::EdgeFlags(cost.size(), 0), cost, {}, ExecutionContext());
}

std::ptrdiff_t edges_of(const mesh::EdgeFlags& flags) {
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

// Of all islands between flagged edges, the angle that inner vertices lack of a full turn, at most.
double most_curvature_inside(const mesh::Surface& surface, const mesh::EdgeFlags& flags) {
  std::vector<double> angle(at(surface.vertices.rows()), 0.0);
  std::vector<char> inside(angle.size(), 1);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flags.size()); ++h) {
    const auto p = [&](HalfedgeId g) {
      return Vector3(surface.vertices.row(mesh::source(surface.faces, g)).transpose());
    };
    const Vector3 a = p(next_corner(h)) - p(h);
    const Vector3 b = p(previous_corner(h)) - p(h);
    angle[at(mesh::source(surface.faces, h))] += std::acos(a.dot(b) / (a.norm() * b.norm()));
    if (flags[at(h)] == 0) continue;
    inside[at(mesh::source(surface.faces, h))] = inside[at(mesh::target(surface.faces, h))] = 0;
  }
  double most = 0.0;
  for (std::size_t v = 0; v < angle.size(); ++v) {
    if (inside[v] != 0) most = std::max(most, std::abs(angle[v] - 2 * std::numbers::pi));
  }
  return most;
}

Index islands_of(const mesh::Surface& surface, const mesh::EdgeFlags& flags) {
  return mesh::components_between(surface.adjacency(), flags).count;
}

TEST(Nets, plates_with_holes_unfold_without_stretch) {
  const mesh::Surface plate = test::perforated_plate(2, 3);
  const mesh::EdgeFlags flags = nets_of(plate);
  EXPECT_GT(edges_of(flags), 0);
  EXPECT_LT(most_curvature_inside(plate, flags), 1e-9);
}

TEST(Nets, a_cylinder_is_a_rolled_side_and_two_caps) {
  const mesh::Surface can = turned(24, {{1, 0}, {1, 2}}, 0, 2);
  const mesh::EdgeFlags flags = nets_of(can);
  EXPECT_LT(most_curvature_inside(can, flags), 1e-9);
  // Both rims, but for an edge by which a cap may hang on the side, and one seam along it.
  EXPECT_GE(edges_of(flags), 2 * 23 + 1);
  EXPECT_LE(edges_of(flags), 2 * 24 + 1);
}

TEST(Nets, long_strips_are_divided) {
  const mesh::Surface ring = turned(64, {{8, 0}, {8, 0.5}, {7, 0.5}, {7, 0.1}}, 0.1, 0.1);
  const mesh::EdgeFlags flags = nets_of(ring);
  if (edges_of(flags) > 0) {
    EXPECT_GT(islands_of(ring, flags), 2);
  }
}

TEST(Nets, are_the_same_for_any_place_and_unit) {
  mesh::Surface plate = test::perforated_plate(1, 2);
  const mesh::EdgeFlags flags = nets_of(plate);
  const double c = std::cos(0.7);
  const double s = std::sin(0.7);
  for (Eigen::Index v = 0; v < plate.vertices.rows(); ++v) {
    const Vector3 p = plate.vertices.row(v).transpose();
    plate.vertices.row(v) << 8 * (c * p.x() - s * p.z()) + 1, 8 * p.y(),
        8 * (s * p.x() + c * p.z());
  }
  EXPECT_EQ(nets_of(plate), flags);
}

TEST(Nets, round_things_have_none) {
  EXPECT_EQ(edges_of(nets_of(test::sphere(24, 12))), 0);
  EXPECT_EQ(edges_of(nets_of(test::torus(24, 12))), 0);
}

}  // namespace
}  // namespace flipfree::unwrap::nets_test
