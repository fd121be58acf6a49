// One winding for every part of a surface.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

struct Orientation {
  std::vector<char> turned;           // #F: the face is to be turned over
  std::vector<HalfedgeId> one_sided;  // lower half-edge of the pairs that were undone, ascending
};

// Parts are faces joined by mates, but not at seams (3 #F). Within each, faces are turned until
// mates run in opposite directions; the least area is turned, the first face stays if both
// ways are equal. Where a part comes back to itself from its other side, mates are undone (`mate`),
// and so are mates at seams that still run in one direction; those are not listed. With a map of the
// faces (3 #F x 2, or null), parts that mates, also those at seams, join to a face wound the other
// way are turned until most of their area in the map is positive. Cost: O(#F).
Orientation orient(const Points3& positions, const Triangles& faces,
                   const std::vector<char>& at_seam, const Points2* corner_uv,
                   std::vector<HalfedgeId>& mate, const ExecutionContext& context);

}  // namespace flipfree::mesh
