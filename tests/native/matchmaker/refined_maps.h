// Refined maps for tests of what moves, refines and coarsens them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "flipfree/certify/measures.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/at_once/class_overlay.h"
#include "flipfree/matchmaker/coarsening/remove_vertex.h"
#include "support/shapes.h"

namespace flipfree::test {

// A grid, slightly warped so that nothing is collinear.
inline mesh::Surface warped_grid(Index columns) {
  mesh::Surface surface = grid(columns, columns);
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
    const double x = surface.vertices(v, 0);
    const double y = surface.vertices(v, 1);
    const double bump = x * (1 - x) * y * (1 - y);
    surface.vertices(v, 0) += 0.1 * bump * std::sin(7 * y);
    surface.vertices(v, 1) += 0.1 * bump * std::cos(5 * x);
  }
  return surface;
}

inline mesh::RefinedMap identity_map(const mesh::Surface& surface) {
  return {mesh::make_refined_surface(surface), surface.vertices.leftCols(2)};
}

// The surface as it lies in the plane, with so many of its edges split in the middle, evenly
// chosen.
inline mesh::RefinedMap split_flat(const mesh::Surface& surface, Index count) {
  mesh::RefinedMap map = identity_map(surface);
  mesh::EditableTriangulation& mesh = map.surface.mesh;
  std::vector<std::pair<VertexId, VertexId>> edges;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (mesh.edge(h) == h && !mesh.is_boundary(h))
      edges.emplace_back(mesh.source(h), mesh.target(h));
  }
  const Index all = mesh.vertex_count();
  map.uv.conservativeResize(all + count, 2);
  for (Index i = 0; i < count; ++i) {
    const auto& [a, b] =
        edges[static_cast<std::size_t>(i) * edges.size() / static_cast<std::size_t>(count)];
    const VertexId v = map.surface.split_edge(mesh.find(a, b));
    map.uv.row(v) = 0.5 * (map.uv.row(a) + map.uv.row(b));
  }
  return map;
}

// Moves every vertex from `keep` on by so much, each in another direction.
inline void bend(mesh::RefinedMap& map, VertexId keep, double by) {
  for (VertexId v = keep; v < map.surface.mesh.vertex_count(); ++v)
    map.uv.row(v) += by * Vector2(std::cos(v), std::sin(v)).transpose();
}

// Moves a vertex of a map of the unit square past two others that stay.
inline void move_past(mesh::RefinedMap& map, VertexId v, const Vector2& goal,
                      ExecutionContext& context) {
  matchmaker::Constraints constraints;
  for (const VertexId b : map.surface.boundary)
    constraints.outline.emplace_back(map.uv.row(b).transpose());
  constraints.pins = {{v, goal}};
  for (const Vector2& stays : {Vector2(0.45, 0.62), Vector2(0.6, 0.4)}) {
    Eigen::Index nearest = 0;
    (map.uv.rowwise() - stays.transpose()).rowwise().squaredNorm().minCoeff(&nearest);
    constraints.pins.push_back({static_cast<VertexId>(nearest), map.uv.row(nearest).transpose()});
  }
  Stats stats;
  ASSERT_TRUE(matchmaker::place_pins(map, constraints, context, stats));
  ASSERT_EQ(Vector2(map.uv.row(v).transpose()), goal);
}

// The same on a grid, which leaves some hundred vertices behind, thinned out with everything else
// where it is.
inline mesh::RefinedMap drawn_out(const mesh::Surface& surface, VertexId v,
                                  ExecutionContext& context) {
  mesh::RefinedMap map = identity_map(surface);
  move_past(map, v, {0.7123, 0.5317}, context);
  while (matchmaker::thin_out(map, {v}, static_cast<Index>(surface.vertices.rows()), context) > 0)
    continue;
  return map;
}

// A square of 20 x 20 squares in which `moved` was drawn past two others; its own vertices are
// below `keep`.
struct DrawnOutSquare {
  std::unique_ptr<mesh::Surface> surface;  // which the map's refers to
  VertexId moved = 21 * 10 + 4;
  Index keep = 21 * 21;
  mesh::RefinedMap map;
};

inline DrawnOutSquare drawn_out_square(ExecutionContext& context) {
  DrawnOutSquare square{.surface = std::make_unique<mesh::Surface>(grid(20, 20)), .map = {}};
  square.map = drawn_out(*square.surface, square.moved, context);
  return square;
}

// Every face positive in the map and in its parent, and once around every inner vertex.
inline void expect_valid(const mesh::RefinedMap& map) {
  map.surface.mesh.check_invariants();
  ASSERT_EQ(map.uv.rows(), map.surface.mesh.vertex_count());
  const ExecutionContext context;
  std::vector<FaceId> slots;
  const Triangles faces = map.surface.mesh.faces(&slots);
  EXPECT_TRUE(distortion::find_flips(faces, map.uv, context).empty());
  for (FaceId f = 0; f < faces.rows(); ++f) {
    const FaceId parent = map.surface.mesh.parent(slots[static_cast<std::size_t>(f)]);
    EXPECT_GT(map.surface.orientation_in_parent(parent, faces(f, 0), faces(f, 1), faces(f, 2)), 0)
        << f;
  }
  Points2 corner_uv(faces.size(), 2);
  for (CornerId c = 0; c < faces.size(); ++c) corner_uv.row(c) = map.uv.row(faces.data()[c]);
  const mesh::EdgeFlags no_cuts(static_cast<std::size_t>(faces.size()), 0);
  EXPECT_TRUE(certify::winding_failures(
                  mesh::build_adjacency(map.surface.mesh.vertex_count(), faces), no_cuts, corner_uv)
                  .empty());
}

// Valid, pins and outline where they shall be bit for bit.
inline void expect_arrived(const mesh::RefinedMap& map,
                           const matchmaker::Constraints& constraints) {
  expect_valid(map);
  for (const matchmaker::PinnedVertex& p : constraints.pins)
    EXPECT_EQ(Vector2(map.uv.row(p.vertex).transpose()), p.uv) << p.vertex;
  for (std::size_t i = 0; i < constraints.outline.size(); ++i)
    EXPECT_EQ(Vector2(map.uv.row(map.surface.boundary[i]).transpose()), constraints.outline[i]);
}

inline matchmaker::Constraints boundary_as_it_is(const mesh::RefinedMap& map) {
  matchmaker::Constraints constraints;
  for (const VertexId v : map.surface.boundary)
    constraints.outline.emplace_back(map.uv.row(v).transpose());
  return constraints;
}

}  // namespace flipfree::test
