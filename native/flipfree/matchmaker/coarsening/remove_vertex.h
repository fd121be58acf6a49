// Removes an added vertex from a refined map: what fills its star then.
//
// Every new triangle is positive in the input face it lies in, by exact test; a star that lies on
// an edge of the input is retriangulated on both sides of that edge. In the map triangles are
// positive as well, or, for a caller that untangles afterwards, as far as may be.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// One pass over the vertices from `keep` on that are not held, the last added first: each goes
// where the map stays valid without it, also as stored, and no triangle becomes worse than the
// worst removed or a few times the map's mean energy. Cost: O(valence^3) per vertex. Removed ones
// are compacted away; vertices below `keep` keep their ids. Returns the number removed.
Index thin_out(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
               ExecutionContext& context);

// Takes refinement back where the vertices around have to move for it: an added vertex is left out,
// its star filled whether or not all of it is positive, and the neighbourhood untangled
// (untangle.h), its rim held.
//
// What remove_vertex.h leaves behind are local minima: no vertex can go as the others lie, although
// most can when their neighbours make room.

// One pass over the vertices from `keep` on that are not held, the last first. Vertices within
// `rings` edges of the one that is removed may move. The boundary does
// not move, nor do `held` vertices. The map stays valid, also as stored, and interior vertices go
// on winding once. Returns the number removed; vertices stay as isolated ones until compacted.
// Cost: some twenty Newton steps on fifty triangles per vertex, half a millisecond; with one ring a
// third of it.
Index remove_by_untangling(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                           int rings, ExecutionContext& context);

}  // namespace flipfree::matchmaker
