// Brings pins to their targets along maps that are all flip-free, refining the surface only where
// the way is blocked.
//
// First all pins together by continuation (distortion/targets.h). If that stops, one after another,
// each held once it has arrived; one that is blocked waits for the others, and if all wait, the
// triangles that block it are split. Every map on the way is valid, so nothing has to be repaired,
// and interior vertices keep winding once, which untangling with a free boundary does not ensure.
// There is no guarantee of arrival; MatchMaker++ (pipeline.h) gives that.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/pipeline.h"

namespace flipfree {

// Precondition: map.uv is flip-free, a prescribed boundary is at its targets. True if all pins
// arrived bit for bit; then `map` is the result, otherwise some valid map on the way. At most
// `added_limit` vertices are added. Stats: "walk.*".
bool walk_pins(RefinedMap& map, const Constraints& constraints, Index added_limit,
               ExecutionContext& context, Stats& stats);

}  // namespace flipfree
