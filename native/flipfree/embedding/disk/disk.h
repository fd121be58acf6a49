// A disk whose boundary is fixed: who is an unknown and who is not. Shared by all embedding
// methods.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::embedding {

// Numbering of the vertices of a disk: boundary vertices by their place in the loop, inner ones by
// vertex id.
struct DiskNumbering {
  std::vector<Index> boundary_index;  // #V: place in the loop, kInvalid for others
  std::vector<Index>
      inner_index;  // #V: number among the inner vertices, kInvalid for others and isolated ones
  std::vector<VertexId> inner;  // inner_index -> vertex
};
DiskNumbering number_disk(const Triangles& faces, Index vertex_count,
                          const std::vector<VertexId>& loop);

// Neighbours of the inner vertices: half-edge targets grouped by source, in face order. Each
// neighbour of an inner vertex appears once. corner[k] = 3 f + c is the half-edge from the vertex
// to neighbour target[k].
struct InnerStars {
  std::vector<Index> start;  // #inner + 1
  std::vector<HalfedgeId> halfedge;
};
InnerStars inner_stars(const Triangles& faces, const DiskNumbering& numbering);

}  // namespace flipfree::embedding
