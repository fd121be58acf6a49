// MatchMaker++ (matchmaker_pp.h), and its map made fit for use (usable_map.h): the way that is
// always there.
#pragma once

#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/finish/usable_map.h"
#include "flipfree/matchmaker/ways/problem.h"

namespace flipfree::matchmaker {

// Valid and meets `constraints`; throws NotConverged where a piece of the target is thinner than 64
// bits resolve. With `bijective`, which only a one-to-one start can hold, it does not overlap
// itself. `target`: full_target() of a prescribed boundary, if there is one already.
mesh::RefinedMap guaranteed(const mesh::RefinedSurface& surface, const Constraints& constraints,
                            bool bijective, ExecutionContext& context, Stats& stats,
                            const Target* target = nullptr);

Solution by_matchmaker(const Problem& problem, ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
