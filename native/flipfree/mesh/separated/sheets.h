// The vertices of paired faces: one for every fan, and edges that indices can tell apart.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::mesh {

struct Sheets {
  std::vector<VertexId> vertex;    // 3 #F: the new vertex at every corner
  std::vector<VertexId> origin;    // new vertex -> old one, not descending
  std::vector<HalfedgeId> parted;  // lower half-edge of the pairs that were undone, ascending
};

// `opposite`: 3 #F, of oriented faces, kInvalid on borders. Faces around a vertex that follow each
// other across mates share a new vertex. Pairs of vertices name edges afterwards: where two edges
// would have the same ends, fans between them are cut (`opposite` changes, `parted` lists it).
// `doubtful`: lists of half-edges between the same two old vertices, of every edge that has more
// than one pair or border. `polygon`: #F or null; cuts run between polygons where they can. Cost:
// O(#F) for each round of cuts, of which one is enough as a rule.
Sheets make_sheets(const Triangles& faces, std::vector<HalfedgeId>& opposite,
                   std::vector<std::vector<HalfedgeId>> doubtful,
                   const std::vector<Index>* polygon = nullptr);

}  // namespace flipfree::mesh
