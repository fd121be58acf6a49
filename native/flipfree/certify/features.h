// G8: which edges of a mesh are isolines of a map of it.
#pragma once

#include <vector>

#include "flipfree/certify/measures.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::certify {

// The rows of `features` (pairs of vertices) that are no isoline: an edge whose corners differ in
// both coordinates on some side, or which bends where the map's surface divides it. `parent`: whose
// edges they are, with the provenance of the map's surface, which subdivides it; its faces null:
// the surface's own. Precondition: no flipped face, seams of
// quarter turns. Ascending. Throws InvalidInput (kNotAnEdge) naming a pair that is no edge. Cost:
// O(#F + #features log #features).
std::vector<Index> missed_features(const IndexPairs& features, const mesh::Surface& surface,
                                   const mesh::Adjacency& adjacency, const Provenance& parent,
                                   const Points2& corner_uv);

// Throws that InvalidInput.
[[noreturn]] void throw_no_edge(VertexId a, VertexId b, Eigen::Index vertex_count);

}  // namespace flipfree::certify
