// Brings pins to their targets along maps that are all flip-free, refining the surface only where
// the way is blocked.
//
// First all pins together by continuation (distortion/targets.h). If that stops, pins inside a
// convex boundary are planned together (move_as_planned.h), and where the boundary is free and the
// map may overlap itself, every pin gets an arm of its own (arms.h). Otherwise they go one after
// another, the nearest first, each held once it has arrived; pins that wait are free, so the others
// do not wind around them. Every map on the way is valid, so nothing has to be repaired, and
// interior vertices keep winding once, which untangling with a free boundary does not ensure.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

enum class MoveMode { kNone, kTogether, kPlanned, kArms, kOneByOne };

struct MovedPins {
  bool arrived = false;  // all pins, bit for bit: the map is the result, otherwise one on the way
  MoveMode mode = MoveMode::kNone;  // that led there, or was tried last
  bool settled = false;             // coarsen() has nothing to add
};

// Precondition: map.uv is flip-free, a prescribed boundary is at its targets. Without `refine` no
// vertex is added. No guarantee of arrival: pins that are in each other's way are blocked where
// neither a plan nor arms are for them. Stats: "continuation.*", "plan.*", "arms.*".
MovedPins move_pins(mesh::RefinedMap& map, const Constraints& constraints, bool refine,
                    ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
