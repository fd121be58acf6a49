// MatchMaker++ from constraints to a valid map: phases 1 to 3 of thesis 3.3.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/request.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// The same, made fit for use (usable_map.h): the way that is always there. With `bijective`, which
// only a one-to-one start can hold, the map does not overlap itself.
mesh::RefinedMap guaranteed(const mesh::RefinedSurface& surface, const Constraints& constraints,
                            bool bijective, ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
