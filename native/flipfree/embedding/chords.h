// Inner edges whose two ends lie on one straight side of the target polygon: no straight-line map
// exists with them, so they are split at their midpoints. Chords between different sides,
// separating triangles and everything else are kept (thesis 3.2.2 and 3.3 phase 3 split every edge
// between boundary vertices).
#pragma once

#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/embedding/embedding.h"

namespace flipfree::embedding {

// Half-edges (one per edge) of inner edges between boundary vertices that have to be split, because
// a point of the polygon between their ends does not lie strictly beyond them, exactly, as given or
// (if float32) as stored, or does so by less than four units in the last place. Cost: O(#F).
std::vector<HalfedgeId> chords_to_split(const Triangles& faces, Index vertex_count,
                                        const std::vector<VertexId>& loop, const Points2& boundary,
                                        bool float32);

// Puts a vertex on the middle of each of these edges and retriangulates the faces beside them. The
// result's uv is empty. Faces without such an edge keep their number.
Embedding split_edges(const Triangles& faces, Index vertex_count,
                      const std::vector<HalfedgeId>& edges);

}  // namespace flipfree::embedding
