// Carries a map of the coarse disk over to the fine one: the composition of two piecewise linear
// maps, which splits fine triangles only where it must.
//
//      fine surface --uv--> plane <--before-- coarse disk (refined) --uv--> plane
//
// The fine disk and the coarse one cover the same domain. So does the overlay of both, on which the
// composition is linear, locally injective, and meets what the coarse map meets. Instead of the
// overlay, every fine triangle is given the linear interpolant of its corners; where this is turned
// over or squashed, the triangle is split along coarse edges (creases), in a fixed order of these,
// so that splitting ends: at the overlay in the worst case.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/continuation/decimate.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// `disk` comes from decimate(fine, ...), `coarse` is a flip-free map of disk.surface, refined or
// not. True: the fine map is flip-free by exact test, inner vertices wind once, its corners that
// are coarse vertices are where the coarse map has them bit for bit, and at most `most_added`
// vertices were added (at the end of the numbering). False, and the map unchanged, if rounding or
// that limit is in the way. Cost: O(#V) and O(1) of a few dozen exact tests per triangle split.
bool lift_map(mesh::RefinedMap& fine, const CoarseDisk& disk, const mesh::RefinedMap& coarse,
              Index most_added, ExecutionContext& context);

}  // namespace flipfree::matchmaker
