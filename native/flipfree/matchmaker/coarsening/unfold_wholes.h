// Takes refinement back by making room for the input's faces: the energy of the split ones, as they
// would be whole, is lowered until they are positive (untangle.h), while the map itself, as it is
// split, stays valid behind a barrier.
//
// Untangling the whole faces alone succeeds as often, but then vertices wind twice; here they can
// only be taken whole where removing a vertex leaves a valid map (remove_vertex.h).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_map.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::matchmaker {

// `held`: vertices that do not move. Precondition: map.uv is flip-free, inner vertices wind once.
// Guarantee: so it is afterwards, vertices below `keep` are there still. `order`: elimination
// orders by vertex of the map. Cost: at most six times some thirty-five Newton steps near split
// faces.
void unfold_wholes(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                   ExecutionContext& context, numeric::EliminationMemory& order);

}  // namespace flipfree::matchmaker
