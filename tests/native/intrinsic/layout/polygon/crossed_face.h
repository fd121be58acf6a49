// Single triangles that are crossed by chords, and where these are in the plane.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/intrinsic/layout/polygon/polygon_triangulation.h"
#include "flipfree/intrinsic/layout/refine/edge_point_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::test {

struct CrossedFace {
  mesh::Surface surface;
  mesh::Adjacency adjacency;
  intrinsic::EdgePointMap map;
  std::array<Index, 3> count{};
  std::vector<intrinsic::PolygonVertex> polygon;
};

// `corner`: places of the corners; `side[k]`: places of points from corner k on.
inline CrossedFace crossed_face(const std::array<Vector2, 3>& corner,
                                const std::array<std::vector<Vector2>, 3>& side) {
  CrossedFace out;
  out.surface.vertices.resize(3, 3);
  out.surface.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  out.surface.faces.resize(1, 3);
  out.surface.faces << 0, 1, 2;
  out.adjacency = mesh::build_adjacency(3, out.surface.faces);
  intrinsic::EdgePointMap& map = out.map;
  map.corner_uv.resize(3, 2);
  map.begin.push_back(0);
  const auto add = [&](std::uint8_t sides, const Vector3& domain, const Vector2& uv) {
    intrinsic::PolygonVertex v;
    v.id = static_cast<Index>(out.polygon.size());
    v.sides = sides;
    v.domain = {domain.x(), domain.y()};
    v.uv = {uv.x(), uv.y()};
    out.polygon.push_back(v);
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3, previous = (k + 2) % 3;
    const Vector3 from = out.surface.vertices.row(static_cast<Eigen::Index>(k));
    const Vector3 to = out.surface.vertices.row(static_cast<Eigen::Index>(next));
    const std::size_t n = side[k].size();
    add(static_cast<std::uint8_t>((1u << k) | (1u << previous)), from, corner[k]);
    for (std::size_t i = 0; i < n; ++i) {
      const double t = static_cast<double>(i + 1) / static_cast<double>(n + 1);
      add(static_cast<std::uint8_t>(1u << k), (1 - t) * from + t * to, side[k][i]);
      map.points.push_back({{1 - t, t}, side[k][i], side[k][i]});
    }
    out.count[k] = static_cast<Index>(n);
    map.corner_uv.row(static_cast<Eigen::Index>(k)) = corner[k];
    const Vector2 first = n == 0 ? corner[next] : side[k].front();
    const Vector2 last = side[previous].empty() ? corner[previous] : side[previous].back();
    map.corner_angle.push_back(turn(first - corner[k], last - corner[k]));
    map.edge_halfedge.push_back(static_cast<HalfedgeId>(k));
    map.edge_of.push_back(static_cast<Index>(k));
    map.begin.push_back(static_cast<std::int64_t>(map.points.size()));
  }
  return out;
}

// Chords from the last corner to so many points of the side opposite to it.
inline CrossedFace fan_from_last_corner(Index count) {
  std::array<std::vector<Vector2>, 3> side;
  for (Index i = 1; i <= count; ++i) {
    const double x = static_cast<double>(i) / (count + 1);
    side[0].emplace_back(x, x * (x - 1));
  }
  return crossed_face({Vector2{0, 0}, Vector2{1, 0}, Vector2{0.5, 1}}, side);
}

// So many chords around the first corner: a road with bends, its chords turned to and fro.
inline CrossedFace winding_face(Index count) {
  std::array<std::vector<Vector2>, 3> side;
  Vector2 middle = Vector2::Zero();
  double heading = 0.0;
  std::vector<Vector2> left;
  for (Index i = 0; i < count; ++i) {
    heading += 0.1 * std::sin(0.37 * i + 1.0);
    middle += Vector2(std::cos(heading), std::sin(heading));
    const double across = heading + 1.5 + 0.6 * std::sin(0.11 * i);
    const Vector2 half(std::cos(across), std::sin(across));
    side[0].push_back(middle - half);
    left.push_back(middle + half);
  }
  side[2].assign(left.rbegin(), left.rend());
  const std::size_t last = static_cast<std::size_t>(count) - 1;
  return crossed_face({0.5 * (side[0][0] + left[0]) - (side[0][1] - side[0][0]),
                       2 * side[0][last] - side[0][last - 1], 2 * left[last] - left[last - 1]},
                      side);
}

}  // namespace flipfree::test
