// G2: how often the corners around an interior vertex wind, decided exactly.
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut_graph/cut.h"

namespace flipfree::certify {

// Interior vertices without a cut edge around which the corners do not wind exactly once.
// Precondition: no flipped face, so that each corner turns by less than half a turn. Ascending.
// Cost: O(#F).
std::vector<VertexId> winding_failures(const mesh::Adjacency& adjacency,
                                       const mesh::EdgeFlags& cuts, const Points2& corner_uv);

}  // namespace flipfree::certify
