// The ways to a map that meets all constraints, one after another: the cheap ones that may be
// blocked first, the guarantee last.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/request.h"

namespace flipfree::matchmaker {

// The first map that is found, with its refinement taken back and its distortion as it is. What the
// target's domain refuses (outline_target.h) is refused before any work. Throws NotConverged if no
// way leads there. Stats: those of the ways, "ways_out_of_time" (ways whose share of the time was
// over).
Solution solve(const Problem& problem, ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
