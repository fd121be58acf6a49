// MatchMaker++ from constraints to a valid map: phases 1 to 3 of thesis 3.3.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/patches/build_target.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// `target`: full_target() of a prescribed boundary, if there is one already. Guarantee: the result
// exists for every target that full_target() accepts, up to the resolution of 64-bit coordinates
// (NotConverged if a piece of the target is thinner). With a free boundary the map is one-to-one.
// It is refined generously and distorted; optimising it and taking the refinement back come after.
// Stats: "matchmaker.*". Precondition: at least one pin, or a prescribed boundary.
mesh::RefinedMap run_matchmaker(const mesh::RefinedSurface& surface, const Constraints& constraints,
                                ExecutionContext& context, Stats& stats,
                                const Target* target = nullptr);

// Figures for "matchmaker.*" of a map by this partition.
void note_matchmaker(const mesh::RefinedMap& map, const ConvexPartition& partition, Stats& stats);

}  // namespace flipfree::matchmaker
