// Where the boundary of a seamless map has its corners, if nobody says so.
//
// An aligned curve runs along the axes: each of its edges has one of four directions, and where
// that changes there is a corner. The edges get the directions that lie nearest to their own,
// corners where these are sharp, and as many more as the turning asks for; found by dynamic
// programming along the curve. The teeth of a jagged curve are no corners: its direction is
// smoothed first.
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// A curve of a boundary, surface on the left; edge i leads from its vertex i to the next one.
struct BorderCurve {
  std::vector<double> length;
  std::vector<double> turning;  // of the surface at vertex i, quarter turns to the left
  double direction = 0.0;       // of edge 0, quarter turns from an axis that its part has
  Index part = 0;    // curves of one part are aligned together: their axes are one where it is flat
  Index wanted = 0;  // quarter turns to the left, in all
};

// Quarter turns k of the angles at the vertices, 1 or more; sum of 2 - k as `wanted`. Empty for a
// curve that has fewer vertices than corners to the left that it needs. Every curve has a positive
// length. Throws Cancelled. Cost: linear, about a thousand steps a vertex.
std::vector<std::vector<Index>> choose_corners(const std::vector<BorderCurve>& curves,
                                               ExecutionContext& context);

}  // namespace flipfree::seamless
