// Brings many pins to their targets at one stroke where the boundary is free and the map may
// overlap itself: every pin gets an arm of its own.
//
// The surface is laid into a circle and from there onto a star, whose arms lead to the
// targets and may cross each other. So nothing winds around anything, in whatever order the pins
// are, and what is added grows linearly with their number: a map that is one-to-one has to wind
// lines around lines (MatchMaker++, thesis 3.3), and so does one that grows out of such a map by
// moving pins past each other. A star depends on the point that the pins are seen
// from. Several are tried as they are, those that come to rest with the least distortion with the
// surface on them, and of these the one is taken that adds fewest vertices; taking refinement back
// is for the caller.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/request/request.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// The surface in a circle, all of it with room.
mesh::RefinedMap in_circle(const mesh::RefinedSurface& surface, ExecutionContext& context);

// Precondition: map.uv is flip-free. True: the map is flip-free by exact test, all pins are where
// they should be bit for bit; vertices were added at the end of the numbering, some of them on the
// boundary. What map.uv was does not matter. False, and the map unchanged, where the boundary is
// prescribed or the map must be one-to-one, with lines, with fewer than three pins, or where
// doubles are not enough. Cost: an embedding into a circle, some hundred Newton steps, and O(log)
// per crossing of the surface's edges with the star's.
bool move_with_arms(mesh::RefinedMap& map, const Constraints& constraints,
                    ExecutionContext& context);

}  // namespace flipfree::matchmaker
