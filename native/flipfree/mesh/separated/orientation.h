// One winding for every part of a surface.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

struct Orientation {
  std::vector<char> turned;           // #F: the face is to be turned over
  std::vector<HalfedgeId> one_sided;  // lower half-edge of the pairs that were undone, ascending
};

// Parts are faces joined by mates, but not at seams (3 #F). Within each, faces are turned until
// mates run in opposite directions; the least area is turned, the first face stays if both
// ways are equal. Where a part comes back to itself from its other side, mates are undone, and so
// are mates at seams that still run in one direction; those are not listed. With a map of the faces
// (3 #F x 2, or null), parts that hang together with contradicting windings or crowded edges,
// across seams too, are turned until most of their area in the map is positive: which way they were
// meant is not to be known. Mates within a polygon (input.polygon) are undone only if that alone
// has one side. Cost: O(#F).
Orientation orient(const PairingInput& input, EdgePairs& pairs, const ExecutionContext& context);

}  // namespace flipfree::mesh
