// A map that is known at the input's corners and at points along its edges, before it is
// triangulated.
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/intrinsic/overlay/overlay_positions.h"

namespace flipfree::intrinsic {

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

}  // namespace flipfree::intrinsic
