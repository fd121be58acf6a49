// Moving pins on large surfaces: coarse to fine.
//
// What takes long on a fine mesh is the way: dozens of Newton steps that all move far. So the flat
// disk is decimated (decimate.h), the pins are moved there (move_pins.h), and the fine map is
// carried along (lift_map.h) and settles (settle.h), over as many levels as it takes.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// If all pins arrive over coarse levels `map` is the result, with as much refinement taken back as
// goes; otherwise it is unchanged. They do not if the surface is small, has lines, or a level
// fails; move_pins() may arrive all the same. Preconditions are those of move_pins(). Stats: those
// of the coarsest level, "continuation.levels" (coarse levels; 0 if it does not arrive),
// "continuation.coarsest" (vertices of the coarsest), "continuation.lifted" (vertices that carrying
// maps over added at first).
bool move_coarse_to_fine(mesh::RefinedMap& map, const Constraints& constraints,
                         ExecutionContext& context, Stats& stats);

// Are there coarse levels for it?
bool has_coarse_levels(const mesh::RefinedSurface& surface, const Constraints& constraints);

}  // namespace flipfree::matchmaker
