// From constraints to the target domain of phase 1, whichever kind it is.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/paths/trace_paths.h"
#include "flipfree/matchmaker/target/outline_target.h"

namespace flipfree::matchmaker {

// Everything: outline (or a box around the pins, for a surface with a collar), pins, lines, paths.
// In a target that overlaps itself a pin without a path must have one sheet to lie in: none is
// Infeasible (kContradictoryPins), several are InvalidInput (kBadPins; give a path).
Target full_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                   const ExecutionContext& context);

// given[e] for every edge of the partition, from the target's list. Throws InternalError if one is
// no edge of it.
Paths given_paths(const Target& target, const ConvexPartition& partition);

}  // namespace flipfree::matchmaker
