// From a valid map to one that is fit for use: less distorted, and with as few added vertices as
// time allows. All of these leave a valid map, whatever fails and whenever time is over.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/request.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// The last step: a valid map in 64 bits becomes one in the 32 bits that are stored.

// round_to_storage() of the map. With `bijective` its boundary does not meet itself. Stats:
// "rounding.*". Throws NotConverged (kRoundingFlips) naming input faces where no 32-bit points are
// found. When the context's time is over, or nearly so, it has seconds_to_store().
Points2f store_map(const mesh::RefinedMap& map, const std::vector<VertexId>& held, bool bijective,
                   ExecutionContext& context, Stats& stats);

// Seconds that rounding and certifying a map takes, generously, unless much has to be repaired.
double seconds_to_store(const mesh::RefinedSurface& surface);

// Lowers the distortion with the constraints held, as far as time allows. Returns the map unchanged
// if there is nothing to move. Stats: "distortion.*", "optimise_failure", "time_limit_reached".
Points2 optimise(const mesh::RefinedSurface& surface, std::vector<VertexId> held, const Points2& uv,
                 int iterations, bool bijective, ExecutionContext& context, Stats& stats);

// How many Newton steps a map is worth: where it was refined much, what they cost is bounded.
int affordable_steps(const mesh::RefinedSurface& surface, int wanted);

// Does the image of the boundary meet itself? Exact.
bool overlaps(const mesh::RefinedSurface& surface, const Points2& uv);

// `fine`, a valid map that is finely cut and much distorted, made usable: optimised and coarsened;
// the vertices of `surface` stay. With `bijective` the result does not overlap itself if `fine`
// does not. Stats: "time_limit_reached".
mesh::RefinedMap made_usable(mesh::RefinedMap fine, const mesh::RefinedSurface& surface,
                             const Constraints& constraints, bool bijective,
                             ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
