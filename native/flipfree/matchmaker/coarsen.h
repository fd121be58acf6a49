// Takes refinement back: removes added vertices wherever the map stays valid without them
// (thesis 3.3 leaves them in).
//
// First, round after round, all vertices that can go as the map stands (thin_out()); between
// rounds the map is relaxed, which frees further ones. Then the rest by unfolding whole faces
// and by untangling: with small neighbourhoods first, with larger ones when these free little.
//
// Removes an added vertex from a refined map: what fills its star then.
//
// Every new triangle is positive in the input face it lies in, by exact test; a star that lies on
// an edge of the input is retriangulated on both sides of that edge. In the map triangles are
// positive as well, or, for a caller that untangles afterwards, as far as may be.
#pragma once

#include <limits>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

struct CoarsenOptions {
  // Vertices are untangled away where no more are added than so many times those to keep; 0:
  // nowhere, for maps whose refinement is what makes them good.
  double most_untangled = 2.0;
  // First, whole faces are unfolded, where the boundary is free to give way for them.
  bool unfold = false;
};

constexpr double kAllUntangled = std::numeric_limits<double>::infinity();

// Precondition: map.uv is flip-free, inner vertices wind once. Guarantee: so it is afterwards, also
// whenever a check of the context throws; `held` vertices are where they were, those below `keep`
// are there still, no vertex more. When the context's time is over it ends with what it has, which
// `stats` ("time_limit_reached") are told. Cost: O(valence^3) per removal, a few Newton steps per
// round; a fifth of a millisecond per vertex and round of untangling at first.
void coarsen(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
             const CoarsenOptions& options, ExecutionContext& context, Stats& stats);

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
// What thin_out() leaves behind are local minima: no vertex can go as the others lie, although
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
