// Removals by untangling (untangle_removal.h), round after round: with small neighbourhoods first,
// with larger ones when these free little. Between rounds the map is relaxed, and what can go
// without untangling goes.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_map.h"
#include "flipfree/numeric/cholesky/elimination_memory.h"

namespace flipfree::matchmaker {

// Precondition: map.uv is flip-free, inner vertices wind once. Guarantee: so it is afterwards,
// held vertices are where they were, vertices below `keep` are there still. Once no more than
// `enough` vertices are added, rounds go on only until a few times `keep` of them were looked at:
// each vertex less costs more time and more energy than the one before. `order`: elimination
// orders by vertex. Cost: a fifth of a millisecond per vertex and round at first.
void ease(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep, Index enough,
          numeric::EliminationMemory& order, ExecutionContext& context);

}  // namespace flipfree::matchmaker
