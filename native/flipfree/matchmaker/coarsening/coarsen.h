// Takes refinement back: removes added vertices wherever the map stays valid without them
// (thesis 3.3 leaves them in).
//
// First, round after round, all vertices that can go as the map stands (remove_vertex.h); between
// rounds the map is relaxed, which frees further ones. Then the rest by unfolding whole faces
// and by untangling: with small neighbourhoods first, with larger ones when these free little.
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

}  // namespace flipfree::matchmaker
