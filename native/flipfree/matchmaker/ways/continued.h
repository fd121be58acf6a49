// The way that needs no guarantee: a valid map without the pins (first_try.h), then the pins moved
// to their targets (move_pins.h).
#pragma once

#include <optional>

#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/ways/problem.h"

namespace flipfree::matchmaker {

// Nothing if there is no such map, or a pin does not arrive. `share`: of the time that is left, for
// all but taking refinement back. Stats: "first_try.*", "continuation.*", "plan.*", "arms.*",
// "coarsen.*".
std::optional<Solution> by_continuation(const Problem& problem, double share,
                                        ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
