// Global bijectivity of charts: does the image of a chart's boundary meet itself? Decided exactly.
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"

namespace flipfree {

struct Overlaps {
  std::int64_t pairs =
      0;  // pairs of boundary edges of the same chart that meet elsewhere than in a shared vertex
  std::vector<FaceId> faces;  // faces at these edges, ascending, at most 1000
};

// For a locally injective map of a planar chart, no pair means that the chart is mapped one-to-one:
// the number of preimages of a point is the sum of the boundary curves' winding numbers, and simple
// disjoint curves with a non-negative sum never reach 2. Different charts are not compared. Cost:
// O(#boundary log #boundary + #pairs).
Overlaps boundary_overlaps(const Triangles& faces, const Adjacency& adjacency,
                           const EdgeFlags& cuts, const Points2& corner_uv);

}  // namespace flipfree
