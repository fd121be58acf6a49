// The way that needs no guarantee: a valid map without the pins (first_try.h), then the pins moved
// to their targets.
//
// On large surfaces what takes long is the way: dozens of Newton steps that all move far. So they
// are decimated, with all pins among the few vertices left, the pins are moved there, and all other
// vertices return to their places one by one (mesh/decimated/): none is added.
#pragma once

#include <optional>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/request.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// Brings pins to their targets, refining the surface only where the way is blocked.
//
// First all pins together by continuation (distortion/targets.h), along maps that are all
// flip-free: nothing has to be repaired, and inner vertices keep winding once, which untangling
// with a free boundary does not ensure. If that stops, pins inside a convex boundary are planned
// together (class_overlay.h), and where the boundary is free and the map may overlap itself, every
// pin gets an arm of its own (arms.h); then refinement is taken back (coarsen.h).

// Precondition: map.uv is flip-free, a prescribed boundary is at its targets. Pins that have
// arrived are at their targets bit for bit; otherwise the map is a valid one on the way.
// `together`: by continuation, which adds no vertex; `refine`: by a plan or arms, where they are
// for such pins. Returns how they arrived ("first try" where there are none), null if they did not.
// Stats: "time_limit_reached".
const char* move_pins(mesh::RefinedMap& map, const Constraints& constraints, bool together,
                      bool refine, ExecutionContext& context, Stats& stats);

// Nothing if there is no such map, or a pin does not arrive. In the end the map lies on the surface
// itself. Stats: "continuation.coarsest" (vertices of the coarse level that all pins arrived on, if
// there is one), "time_limit_reached".
std::optional<Solution> by_continuation(const Problem& problem, ExecutionContext& context,
                                        Stats& stats);

}  // namespace flipfree::matchmaker
