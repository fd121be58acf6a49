// MatchMaker++ from constraints to a valid map: phases 1 to 3 of thesis 3.3.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/patches/build_target.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// Guarantee: the result exists for every target that full_target() accepts, up to the resolution of
// 64-bit coordinates (NotConverged if a piece of the target is thinner). With a free boundary the
// map is one-to-one. It is refined generously and distorted; optimising it and taking the
// refinement back come after. Stats: "matchmaker.*". Precondition: at least one pin, or a
// prescribed boundary.
mesh::RefinedMap run_matchmaker(const mesh::RefinedSurface& surface, const Constraints& constraints,
                                ExecutionContext& context, Stats& stats);

// The last step: the map without collar and unused vertices; figures for "matchmaker.*".
mesh::RefinedMap finished_map(const mesh::RefinedMap& work, const ConvexPartition& partition,
                              Stats& stats);

}  // namespace flipfree::matchmaker
