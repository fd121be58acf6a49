// The lines on which a boundary lies that runs along the axes: boundary edges of the cut surface
// that follow each other in one direction.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "flipfree/distortion/seams/eliminate/cut_map.h"

namespace flipfree::distortion {

struct LineSide {
  Index line = kInvalid;
  Index direction = 0;  // in which the boundary runs on it
};

struct StraightLines {
  // Per cut vertex: of the boundary edge that ends there and of the one that begins there.
  std::vector<std::array<LineSide, 2>> sides;
  // Per line: its vertices, with the direction in which it runs; some twice.
  std::vector<std::vector<std::pair<VertexId, Index>>> vertices;
};

// Cost: O(#V).
StraightLines straight_lines(Index vertex_count, const Triangles& faces,
                             const std::vector<StraightEdge>& straight);

}  // namespace flipfree::distortion
