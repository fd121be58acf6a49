// One winding for every part of a surface.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

struct Orientation {
  std::vector<char> turned;  // #F: the face is to be turned over
  // Lower half-edges of the mates that were undone, ascending: of surfaces with one side, and
  // others. Those of crowded edges are not among them.
  std::vector<HalfedgeId> one_sided, opposed;
};

// Parts are faces joined by mates, but not at seams (3 #F). Within each, faces are turned until
// mates run in opposite directions; the least area is turned, the first face stays if both ways
// are equal. Mates that still run in one direction are undone:
//   - at seams;
//   - where faces contradict each other that are joined by others which all agree (a Moebius strip
//     that is wound along); what then still comes back to itself from its other side is cut
//     between the fronts of a breadth-first walk.
// With a map of the faces (3 #F x 2, or null), parts that hang together with contradicting windings
// or crowded edges, across seams too, are turned until most of their area in the map is positive:
// which way they were meant is not to be known. Mates within a polygon (input.polygon) are undone
// only if that alone has one side. Cost: O(#F).
Orientation orient(const PairingInput& input, EdgePairs& pairs, const ExecutionContext& context);

// Polygons of which the triangles are left. A corner of a polygon has one
// UV, so that a map that is cut along a diagonal cannot be written.

// #F: the same number for triangles that meet at a diagonal (a vertex pair), no others. Where more
// than two meet, diagonals do not tell which go together, and none are joined. Cost: O(#F log #F).
std::vector<Index> polygons_of(const Triangles& faces, Index vertex_count,
                               const IndexPairs& diagonals);

// The sides of all polygons (#F, numbers) that the map (3 #F x 2) is cut through: seams there, and
// these polygons are islands of their own, in one piece. Vertex pairs, each once. Cost: O(#F log
// #F).
IndexPairs sides_of_torn_polygons(const Triangles& faces, const std::vector<Index>& polygon,
                                  const Points2f& corner_uv);

}  // namespace flipfree::mesh
