// What seam edges say of the vertices of the cut surface.
#pragma once

#include <vector>

#include "flipfree/distortion/seams/eliminate/cut_map.h"
#include "flipfree/numeric/exact_elimination.h"

namespace flipfree::distortion {

// to = i^turns from + (unit of the edge) times its translation.
struct Arc {
  VertexId from = kInvalid;
  VertexId to = kInvalid;
  Index turns = 0;
  Index edge = kInvalid;
};
// The same from the other end: from = i^-turns to - i^-turns t.
struct DirectedArc {
  VertexId to = kInvalid;
  Index turns = 0;
  Index edge = kInvalid;
  numeric::GaussianInteger unit;
};

// Both ends of every seam edge. Throws InvalidInput (kBadOption, kIndexOutOfRange) for half-edges
// or vertices that do not exist.
std::vector<Arc> list_arcs(Index vertex_count, const Triangles& faces,
                           const std::vector<SeamEdge>& seams);

}  // namespace flipfree::distortion
