// A square in the plane that is its own map, with a boundary along the axes.
#pragma once

#include "flipfree/distortion/seams/constraints.h"
#include "support/shapes.h"

namespace flipfree::test {

inline distortion::CutMap flat_square(Index n) {
  distortion::CutMap map;
  map.surface = grid(n, n);
  map.uv = map.surface.vertices.leftCols(2);
  const auto count = static_cast<Index>(map.surface.vertices.rows());
  map.straight =
      distortion::straight_boundary(map, mesh::build_adjacency(count, map.surface.faces));
  return map;
}

}  // namespace flipfree::test
