// One winding for every part of a surface.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

struct Orientation {
  std::vector<char> turned;  // #F: the face is to be turned over
  // Lower half-edges of the pairs that were undone, ascending: where a part has one side only, and
  // between pages.
  std::vector<HalfedgeId> one_sided, opposed;
};

// A page is a region of one winding, of this many triangles and this share of its part, that meets
// larger regions of the other winding along a line of at most kPageBorder times the root of its
// area (half a square: 1.41, a square in a corner: 2). Parts have pages if smaller regions, of
// faces here and there, have at most the share kLitter.
inline constexpr Index kPageTriangles = 8;
inline constexpr double kPageBorder = 1.8;
inline constexpr double kPageShare = 1.0 / 16.0;
inline constexpr double kLitter = 0.05;

// Parts are faces joined by mates, but not at seams (3 #F). Within each, faces are turned until
// mates run in opposite directions; the least area is turned, the first face stays if both
// ways are equal. Pages of a part with a border are not turned, the mates between them and larger
// regions are undone. Where a part comes back to itself from its other side, mates are undone,
// those whose windings contradict each other within one region before all others, and so
// are mates at seams that still run in one direction; those are not listed. With a map of the faces
// (3 #F x 2, or null), parts that hang together with contradicting windings or crowded edges,
// across seams too, are turned until most of their area in the map is positive: which way they were
// meant is not to be known. Mates within a polygon (input.polygon) are undone only if that alone
// has one side. Cost: O(#F).
Orientation orient(const PairingInput& input, EdgePairs& pairs, const ExecutionContext& context);

}  // namespace flipfree::mesh
