// Takes refinement back where the vertices around have to move for it: an added vertex is left out,
// its star filled whether or not all of it is positive, and the neighbourhood untangled
// (untangle.h), its rim held.
//
// What remove_vertex.h leaves behind are local minima: no vertex can go as the others lie, although
// most can when their neighbours make room.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/pipeline.h"

namespace flipfree {

// One pass over the vertices from `keep` on that are not held, the last first. The boundary does
// not move, nor do `held` vertices. The map stays valid, also as stored, and interior vertices go
// on winding once. Returns the number removed; vertices stay as isolated ones until compacted.
// Cost: some twenty Newton steps on about a hundred triangles per vertex, a millisecond or two.
Index remove_by_untangling(RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                           ExecutionContext& context);

}  // namespace flipfree
