// Polygons of which the triangles are left. A corner of a polygon has one
// UV, so that a map that is cut along a diagonal cannot be written.
#pragma once

#include <vector>

#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

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
