// Opens the few triangles of a seamless map that are far worse than all others, each within its
// surroundings: as long as there is one, steps of the whole map would be for it alone.
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/distortion/seams/constraints.h"

namespace flipfree::distortion {

// Minimises the distortion of rings around triangles of an energy beyond 18 and around the vertices
// marked in `near` (#V, or empty), in the map's own unit, with everything else and all translations
// held; wider rings where bad triangles are left. `uv` (#V x 2) is flip-free, and stays so. Returns
// the number of bad triangles there were; nullopt, with nothing done, where the rings are no small
// part of the map. Cost: that of the rings' optimisation, and O(#V) for each of its steps.
std::optional<Index> relieve(const SeamConstraints& constraints, const Triangles& faces,
                             const RestShapes& rest, const std::vector<char>& near, Points2& uv,
                             ExecutionContext& context);

}  // namespace flipfree::distortion
