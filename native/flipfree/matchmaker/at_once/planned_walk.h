// Brings many pins to their targets inside a prescribed convex boundary at one stroke: their motion
// is planned together (plan_motion.h), the map follows it (class_overlay.h), and the refinement
// that this leaves is taken back. Where pins are in each other's way, walking them one by one
// (walk_pins.h) draws the map out a thousand times further.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/patches/pipeline.h"

namespace flipfree::matchmaker {

// Preconditions: as walk_pins(). True if all pins arrived bit for bit; false, and the map
// unchanged, if this way is not for these constraints (class_overlay.h) or for so few or so many
// pins. Stats: "plan.*"; "plan.left", vertices added, if there are so many that coarsen() has
// nothing to add.
bool walk_as_planned(mesh::RefinedMap& map, const Constraints& constraints,
                     ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
