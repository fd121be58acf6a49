// Brings many pins to their targets inside a prescribed convex boundary at one stroke: their motion
// is planned together (plan_motion.h), the map follows it (class_overlay.h), and the refinement
// that this leaves is taken back. Where pins are in each other's way, moving them one by one
// (move_pins.h) draws the map out a thousand times further.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

struct PlannedMove {
  bool arrived = false;  // all pins, bit for bit; otherwise the map is unchanged
  bool settled = false;  // so much refinement is left that coarsen() has nothing to add
};

// Preconditions: as move_pins(). Does not arrive if this way is not for these constraints
// (class_overlay.h) or for so few or so many pins. Stats: "plan.*".
PlannedMove move_as_planned(mesh::RefinedMap& map, const Constraints& constraints,
                            ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
