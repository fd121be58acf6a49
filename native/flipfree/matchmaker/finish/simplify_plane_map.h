// Takes vertices away from a piecewise linear map between two triangulations of the same disk.
//
// Two triangulations laid over each other have a vertex per crossing. Few of these are needed, and
// whatever follows the map has to bend at every edge that stays. Neither triangulation is worth
// keeping, so stars are filled as is best in both planes, and vertices move in both, by turns: one
// plane is taken for a surface and the other for its map, then the other way round. (Compatible
// triangulations, as Surazhsky and Gotsman 2004 simplify them.)
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/overlay/mesh_overlay.h"

namespace flipfree::matchmaker {

// Precondition: both sides of `plane` are flip-free; the vertices below `held`, the boundary's
// among them, stay where they are in both planes, all others are kInvalid in plane.vertex.
// Guarantee: no vertex more; both sides are flip-free afterwards by exact test. Cost: up to a
// millisecond per vertex.
void simplify_plane_map(PlaneMap& plane, Index held, ExecutionContext& context);

}  // namespace flipfree::matchmaker
