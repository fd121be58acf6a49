// The last step: a valid map in 64 bits becomes one in the 32 bits that are stored.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// round_to_storage() of the map. Where that finds no 32-bit points for some triangles, added
// vertices are taken away, the map is relaxed around them, and `map` changed accordingly. With
// `bijective` its boundary does not meet itself and does not move. Vertices below `keep` stay, held
// ones where they are. Stats: "rounding.*", "rounding.rooms" (how often room was made). Throws
// NotConverged (kRoundingFlips) naming input faces if that does not help.
// When the context's time is over, or nearly so, it has seconds_to_store() for each attempt.
Points2f store_map(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                   bool bijective, ExecutionContext& context, Stats& stats);

// Seconds that rounding and certifying a map takes, generously, unless much has to be repaired.
double seconds_to_store(const mesh::RefinedSurface& surface);

}  // namespace flipfree::matchmaker
