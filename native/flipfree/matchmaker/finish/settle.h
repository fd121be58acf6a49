// Brings a map that was carried over from a coarser level (lift_map.h) to rest: lowers the
// distortion where it is worst and takes refinement back, mostly in the neighbourhood of what is
// wrong. On a large surface a Newton step of the whole costs a hundred times as much as one there.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// Guarantee: valid as before, held vertices are where they were, no vertex more; vertices below
// `keep` stay. Cost: a few dozen Newton steps near added vertices and badly distorted faces, a few
// of the whole map, and O(#V) per round.
void settle(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
            ExecutionContext& context);

}  // namespace flipfree::matchmaker
