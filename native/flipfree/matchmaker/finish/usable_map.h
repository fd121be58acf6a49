// From a valid map to one that is fit for use: less distorted, and with as few added vertices as
// time allows. All of these leave a valid map, whatever fails and whenever time is over.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// Lowers the distortion with the constraints held, as far as time allows. Returns the map unchanged
// if there is nothing to move. Stats: "distortion.*", "optimise_failure", "time_limit_reached".
Points2 optimise(const mesh::RefinedSurface& surface, std::vector<VertexId> held, const Points2& uv,
                 int iterations, bool bijective, ExecutionContext& context, Stats& stats);

// How many Newton steps a map is worth: where it was refined much, what they cost is bounded.
int affordable_steps(const mesh::RefinedSurface& surface, int wanted);

// Does the image of the boundary meet itself? Exact.
bool overlaps(const mesh::RefinedSurface& surface, const Points2& uv);

// Positive triangles alone keep interior vertices from winding twice exactly if the boundary is
// prescribed and turns once (the count of angles in self_overlapping.h).
bool untangling_is_safe(const Constraints& constraints);

// `fine`, a valid map that is finely cut and much distorted, made usable: optimised and coarsened;
// the vertices of `surface` stay. With `bijective` the result does not overlap itself if `fine`
// does not. Stats: "coarsen.*", "time_limit_reached".
mesh::RefinedMap made_usable(mesh::RefinedMap fine, const mesh::RefinedSurface& surface,
                             const Constraints& constraints, bool bijective,
                             ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
