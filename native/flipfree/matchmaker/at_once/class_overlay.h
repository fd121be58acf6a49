// A map in a given isotopy class, with all pins at their targets, at one stroke.
//
// The class is that of a motion of the pins, the one of thousands with the fewest crossings. A
// triangulation of the pins' sources and one of their targets are laid over each other: in the
// class's tightest position, edges of one cross the triangles of the other along straight lines in
// both, which cut cells of at most six corners, convex in both. So the overlay's map is linear on
// triangles and positive; relaxed, it is a coarse map that meets all pins, and the surface is
// carried along with it (mesh_overlay.h).
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/request/request.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// Preconditions: map.uv is flip-free, `constraints` prescribe a simple boundary that map.uv meets.
// True: the map is flip-free by exact test and meets all pins bit for bit; vertices were added at
// the end of the numbering, some of them along a ring inside the boundary. False, and the map
// unchanged, where the outline is not convex, there are lines or very many pins, pins lie next to
// the boundary, or doubles are not enough.
bool place_pins(mesh::RefinedMap& map, const Constraints& constraints, ExecutionContext& context);

}  // namespace flipfree::matchmaker
