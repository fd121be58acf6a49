// Short disjoint loops that open all handles of a surface (thesis 5.4.1).
//
// Tree and cotree (Eppstein 2003; Erickson, Whittlesey 2005) over the free vertices: the tree has
// the shortest paths from a root, the cotree crosses edges by falling length of the cycle that they
// close in the tree. The edges that are left close cycles that are independent in homology, so any
// of them that are disjoint leave the surface connected when it is cut along them.
#pragma once

#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/paths/canvas.h"

namespace flipfree::seamless {

// By how many quarters a map is to turn along a cycle of vertices.
using CycleTurns = std::function<Index(const std::vector<VertexId>& cycle)>;

// Draws loops through free vertices until there are `genus` of them; returns the vertices of each
// in order. `drawn`: those that are there already, disjoint and independent; nothing else is.
// `wished`: of loops that are not much longer than others, those that are to turn least are taken
// (thesis 6.5.1.1); null: the shortest. Cost: O(#F log #F) a round; a round finds the shortest loop
// of its tree and those that are disjoint and not much longer.
std::vector<std::vector<VertexId>> draw_short_loops(Canvas& canvas, Index genus,
                                                    std::vector<std::vector<VertexId>> drawn,
                                                    const CycleTurns& wished,
                                                    const ExecutionContext& context);

}  // namespace flipfree::seamless
