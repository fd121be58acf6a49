// Is a mesh a disk, and a list of vertices its boundary?
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::embedding {

// Throws InvalidInput unless `faces` (manifold, oriented) are a disk, `loop` lists its boundary in
// order with the surface on the left, and `boundary` has one position per vertex of the loop. Cost:
// O(#F).
void require_disk_with_boundary(const Triangles& faces, Index vertex_count,
                                const std::vector<VertexId>& loop, const Points2& boundary);

}  // namespace flipfree::embedding
