// Maps that are known at corners and at points of edges.
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/intrinsic/layout/input_development.h"
#include "flipfree/intrinsic/layout/refine_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::test {

// A surface under a map of the plane, place(x, y) of its first two coordinates, with so many points
// evenly along every edge.
template <typename Place>
intrinsic::EdgePointMap edge_points(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                    int points, const Place& place) {
  intrinsic::EdgePointMap map;
  const intrinsic::InputEdges edges = intrinsic::number_edges(adjacency);
  map.edge_halfedge = edges.halfedge;
  map.edge_of = edges.of_corner;
  const auto at = [&](VertexId v) -> Vector2 {
    return surface.vertices.row(v).head<2>().transpose();
  };
  const auto corners = static_cast<CornerId>(surface.faces.size());
  map.corner_uv.resize(corners, 2);
  map.corner_angle.assign(static_cast<std::size_t>(corners), 0.0);
  for (CornerId c = 0; c < corners; ++c)
    map.corner_uv.row(c) = place(at(mesh::source(surface.faces, c))).transpose();
  map.begin = {0};
  for (const HalfedgeId h : edges.halfedge) {
    const Vector2 a = at(mesh::source(surface.faces, h)), b = at(mesh::target(surface.faces, h));
    for (int i = 1; i <= points; ++i) {
      const double t = static_cast<double>(i) / (points + 1);
      const Vector2 uv = place(Vector2(a + t * (b - a)));
      map.points.push_back({{1 - t, t}, uv, uv});
    }
    map.begin.push_back(static_cast<std::int64_t>(map.points.size()));
  }
  // Between the first pieces of a corner's two sides.
  for (CornerId c = 0; c < corners; ++c) {
    const CornerId before = 3 * (c / 3) + (c + 2) % 3;
    const Vector2 p = at(mesh::source(surface.faces, c));
    const double t = 1.0 / (points + 1);
    const Vector2 here = place(p);
    const Vector2 one = place(Vector2(p + t * (at(mesh::target(surface.faces, c)) - p))) - here;
    const Vector2 other =
        place(Vector2(p + t * (at(mesh::source(surface.faces, before)) - p))) - here;
    map.corner_angle[static_cast<std::size_t>(c)] = turn(one, other);
  }
  return map;
}

}  // namespace flipfree::test
