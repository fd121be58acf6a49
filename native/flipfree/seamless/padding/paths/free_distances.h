// Distances through free vertices to all of them.
#pragma once

#include <limits>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/paths/canvas.h"

namespace flipfree::seamless {

struct FreeDistances {
  static constexpr double kUnreached = std::numeric_limits<double>::infinity();

  std::vector<double>
      distance;  // #V; kUnreached where no way leads and at vertices that are not free
  std::vector<HalfedgeId>
      arrival;                  // #V: the last half-edge; kInvalid at the root and where unreached
  std::vector<VertexId> order;  // those reached, from near to far
};

// `first`: half-edges to begin with, from vertices at distance zero. root: a free vertex to begin
// at too, or kInvalid. Cost: O(#F log #F).
FreeDistances free_distances(const Canvas& canvas, const std::vector<HalfedgeId>& first,
                             VertexId root, const ExecutionContext& context);

}  // namespace flipfree::seamless
