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
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/intrinsic/refined_start/split_surface.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::intrinsic {

// A place in the plane; 80-bit numbers for their range.
struct Place {
  long double x = 0;
  long double y = 0;
};

// The overlay of the user's triangulation M0 with the final one, T.
struct TracedMesh {
  const OverlayCoordinates* coordinates = nullptr;
  const OverlayTrace* trace = nullptr;
  const OverlayPositions* positions = nullptr;
  const std::vector<HalfedgeId>* halfedge_of_corner =
      nullptr;  // 3 #F: half-edge of M0, corner k to k + 1
  const std::vector<Index>* curve_of_edge =
      nullptr;                             // #E of M0: curve that traces it, kInvalid = none
  const std::vector<char>* cut = nullptr;  // #E of M0: is it a cut or boundary?
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

// `lengths`: per edge of T. Real: double (in 80 bits where lengths
// differ much) or BigFloat. Cost: O(#F +
// crossings).
template <typename Real>
Development develop(const TracedMesh& input, const std::vector<Real>& lengths,
                    const ExecutionContext& context);

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
