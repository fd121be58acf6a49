// The development of the input: places of its corners, and of points along its edges.
//
// On the input's own triangulation the points are where its edges cross the final one. On a
// refined start (split_surface.h) every edge of the input is a chain of pieces with crossings of
// their own, joined by added vertices: these become points of the edge like the others. Vertices
// added inside faces are not needed: a face's image is known from its boundary.
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/intrinsic/layout/development.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/intrinsic/refined_start/split_surface.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::intrinsic {

// The edges of a mesh in corner order.
struct InputEdges {
  std::vector<HalfedgeId> halfedge;  // #E: the corner first seen
  std::vector<Index> of_corner;      // 3 #F
};
InputEdges number_edges(const mesh::Adjacency& adjacency);

struct InputDevelopment {
  Development development;          // of the input's corners and faces; `crossing` has the points
  std::vector<std::int64_t> begin;  // #E + 1: points of edge e, in order along its half-edge
  std::vector<Between> along;       // per point: between the ends of its edge, on the input
};

// The layout of the triangulation that was traced, as it is.
InputDevelopment own_development(Development development, const OverlayTrace& trace,
                                 const OverlayPositions& positions);

// A triangulation that was traced, and how it was laid out.
struct FineDevelopment {
  const Development* development = nullptr;
  const OverlayTrace* trace = nullptr;
  const OverlayPositions* positions = nullptr;
  const InputEdges* edges = nullptr;
  const mesh::Adjacency* adjacency = nullptr;
};
// The layout of the input from that of the surface it was split into.
InputDevelopment composed_development(const FineDevelopment& fine, const SplitSurface& split,
                                      const InputEdges& edges);

}  // namespace flipfree::intrinsic
