// Disjoint short loops around handles (thesis 5.3.1).
#pragma once

#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/paths.h"

namespace flipfree::seamless {

using Loops = std::vector<std::vector<VertexId>>;

// By how many quarters a map is to turn along a cycle of vertices.
using CycleTurns = std::function<Index(const std::vector<VertexId>& cycle)>;

// Draws loops through free vertices until there are `genus` of them. `drawn`: those that are there
// already, disjoint and independent. A round finds the shortest loop of its tree and those that are
// disjoint and not much longer.
Loops draw_short_loops(Canvas& canvas, Index genus, Loops drawn, const CycleTurns& wished,
                       const ExecutionContext& context);

}  // namespace flipfree::seamless
