// The ways to an outline that winds: a map onto a convex polygon, the first frame of a homotopy
// (outline_homotopy.h), and from there to the last.
#pragma once

#include <optional>

#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/ways/problem.h"

namespace flipfree::matchmaker {

// Precondition of both: a prescribed boundary. `share`: of the time that is left, for all but
// taking refinement back. Nothing if they are blocked; why, is in the stats "outline.failure" and
// "overlay.failure".

// Through all frames (move_outline.h). Stats: "outline.*", "coarsen.*".
std::optional<Solution> by_homotopy(const Problem& problem, double share, ExecutionContext& context,
                                    Stats& stats);

// In one step, by cutting (outline_overlay.h). Precondition: no lines. Stats: "matchmaker.*".
std::optional<Solution> by_outline_overlay(const Problem& problem, double share,
                                           ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
