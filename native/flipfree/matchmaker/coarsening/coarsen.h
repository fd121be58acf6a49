// Takes refinement back: removes added vertices wherever the map stays valid without them
// (thesis 3.3 leaves them in).
//
// Removing a vertex retriangulates its star so that every new triangle is positive in the map and
// in the input face it lies in, both by exact test, and no more distorted than the worst it
// replaces or a few times the mean. A star that lies on an edge of the input is retriangulated on
// both sides of that edge. Between passes the map is relaxed, which frees further vertices; at the
// end the rest is untangled vertex by vertex (untangle_removal.h).
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

enum class Coarsening {
  // As above: most vertices go, and the energy may rise without bound.
  kAll,
  // By thin_out() and relaxing alone: fewer vertices go, and the energy stays about what it was.
  // For maps whose refinement is what makes them good, not what was in the way of finding them.
  kBounded,
};

// Guarantee: valid as before, constraints as before, no vertex more. Vertices below `keep` are not
// removed. Stats: "coarsen.removed", "coarsen.passes". Cost: O(valence^3) per removal and a few
// Newton steps per pass. When the context's time is over it ends with what it has
// ("time_limit_reached").
mesh::RefinedMap coarsen(mesh::RefinedMap map, const Constraints& constraints, Index keep,
                         ExecutionContext& context, Stats& stats,
                         Coarsening how = Coarsening::kAll);

}  // namespace flipfree::matchmaker
