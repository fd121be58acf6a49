// Refined input faces laid straight: what is straight is easily removed (coarsen.h).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// Lays added vertices straight, where linear interpolation of the input face's corners puts them,
// in all input faces except those that would be turned over as a whole and those that have to stay
// with them. The map stays valid; vertices below `keep` do not move, nor do those that are held.
// Returns how many vertices are straight.
Index straighten(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                 ExecutionContext& context);

}  // namespace flipfree::matchmaker
