// MatchMaker++ from constraints to a valid map: phases 1 to 3 of thesis 3.3.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// Guarantee: the result exists for every target that full_target() accepts, up to the resolution of
// 64-bit coordinates (NotConverged if a piece of the target is thinner). With a free boundary the
// map is one-to-one. It is refined generously and distorted. Stats: "matchmaker.*". Precondition:
// at least one pin, or a prescribed boundary.
mesh::RefinedMap run_matchmaker(const mesh::RefinedSurface& surface, const Constraints& constraints,
                                ExecutionContext& context, Stats& stats);

// The same, made fit for use (usable_map.h): the way that is always there. With `bijective`, which
// only a one-to-one start can hold, the map does not overlap itself.
mesh::RefinedMap guaranteed(const mesh::RefinedSurface& surface, const Constraints& constraints,
                            bool bijective, ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
