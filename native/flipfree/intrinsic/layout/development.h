// Lays the final flat metric out in the plane, along the edges of the user's own triangulation:
// every corner of an input face and every crossing of an input edge with the final triangulation
// gets its place.
//
// The surface is developed input face by input face, the largest first (a spanning tree of the
// uncut dual over long developed edges), so that errors of large triangles do not pass through
// small ones. Directions are carried as unit vectors beside positions: a small triangle far from
// the origin keeps its shape until the last addition.
//
// Guarantee: away from cuts neighbouring faces get equal places bit for bit; across a cut the two
// sides differ by a rigid motion up to the angle error of the metric.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/intrinsic/refined_start/split_surface.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::intrinsic {

// A place in the plane; 80-bit numbers for their range.
struct Place {
  long double x = 0;
  long double y = 0;
};

struct Development {
  std::vector<Place> corner;         // 3 #F
  std::vector<double> corner_angle;  // 3 #F: angle between the first pieces of a corner's two
                                     // sides, may pass 2 pi; 0 in faces without crossings
  std::vector<std::array<Place, 2>>
      crossing;  // per crossing: left and right of its curve; equal away from cuts
  std::vector<Index> chart_of_face;  // #F
  Index chart_count = 0;
  // Largest distance between two developments of one place, over the largest developed edge: how
  // well the flat metric closes.
  double closing_error = 0.0;
};

// The development of the input: places of its corners, and of points along its edges.
//
// On the input's own triangulation the points are where its edges cross the final one. On a
// refined start (split_surface.h) every edge of the input is a chain of pieces with crossings of
// their own, joined by added vertices: these become points of the edge like the others. Vertices
// added inside faces are not needed: a face's image is known from its boundary.

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

// A metric with its overlay.
struct MetricOverlay {
  const FlippedMetric* metric = nullptr;
  const SplitSurface* split = nullptr;  // the refined start that the metric was computed on, if any
  // Of the triangulation that the metric was computed on.
  mesh::Adjacency adjacency;
  InputEdges edges;
  Overlay overlay;  // of all its edges
};

// Along `cuts` (flags of the input's half-edges) neighbours part. `edges`: of the input. Cost: O(#F
// + crossings).
InputDevelopment develop(const MetricOverlay& overlaid, const InputEdges& edges,
                         const mesh::EdgeFlags& cuts, const ExecutionContext& context);

}  // namespace flipfree::intrinsic
