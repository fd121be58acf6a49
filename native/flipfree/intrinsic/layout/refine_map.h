// Writes a map that is known at the input's corners and at points along its edges with as little
// refinement as it can: input triangles that are flip-free as they are stay whole; points are added
// where they are not, then taken out again wherever the triangles around them stay positive without
// them.
//
// New vertices lie on edges of the input only, so a refined triangle is a triangle fan of its own
// three sides' points: the provenance (G7) is exact, and whatever triangulation is chosen, a face
// of positive UV area in every part makes the map locally injective. Every decision is an exact
// orientation test on both the 64-bit and the 32-bit values.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/intrinsic/layout/polygon_triangulation.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {

// A map that is known at the input's corners and at points along its edges, before it is
// triangulated.

// A point inside an edge of the input.
struct EdgePoint {
  Between along;     // weights of the edge's two ends
  Vector2 uv_left;   // seen from the edge's half-edge
  Vector2 uv_right;  // seen from its opposite; equal to the left one away from cuts
};

struct EdgePointMap {
  Points2 corner_uv;                 // 3 #F x 2
  std::vector<double> corner_angle;  // 3 #F: developed angle between the first pieces of its sides,
                                     // may pass 2 pi; of faces with points on their sides
  std::vector<HalfedgeId> edge_halfedge;  // #E: one half-edge (corner) of each edge
  std::vector<Index> edge_of;             // 3 #F: edge of every half-edge
  std::vector<std::int64_t> begin;        // #E + 1: points of edge e in order along its half-edge
  std::vector<EdgePoint> points;
};

// Whole turns: does a triangulation of a face's image wind around its corners as often as the map
// does?
//
// A cone of more than 2 pi may lie at a face whose corner angle is itself larger than pi or even 2
// pi. Then the three corners alone can form a positive triangle that is nevertheless not the face's
// image: its angles differ from the developed ones by full turns. The developed angle at a corner
// is known from the layout; for a subset of the points on the sides it changes by the winding of
// the skipped part of the side around the corner.

// A map on a refinement of the input whose new vertices lie on the input's edges.

struct RefinedLayout {
  mesh::Surface surface;           // the input's vertices first
  Points2 uv;                      // 3 #F x 2
  mesh::Provenance provenance;     // of faces and vertices
  std::vector<Index> edge_vertex;  // per point of the EdgePointMap: its vertex, kInvalid = left out
  std::vector<FaceId> invalid;     // input faces without a triangulation that is valid as stored
};

// The edges of the input whose half-edges of `map` are flagged, as vertex pairs of the layout.
IndexPairs edges_on(const Triangles& faces, const EdgePointMap& map, const mesh::EdgeFlags& flagged,
                    const RefinedLayout& layout);

// Empty if every face lies in its parent, every parent is covered with the right orientation, and,
// where none is `invalid`, every UV triangle is positive by exact test. Otherwise what is broken.
// Cost: O(#F).
std::string find_broken_invariant(const mesh::Surface& input, const RefinedLayout& layout);

enum class Refinement {
  kAuto,    // only where needed
  kNever,   // the input's triangles, valid or not
  kFull,    // every point, whether needed or not
  kClosely  // as kAuto, with points however near each other where others do not do
};

// Cost: O(#F + points) plus O(k^3) per triangulated polygon of k points, k small after thinning.
RefinedLayout refine_map(const mesh::Surface& input, const EdgePointMap& map, Refinement refinement,
                         Storage storage, const ExecutionContext& context);

}  // namespace flipfree::intrinsic
