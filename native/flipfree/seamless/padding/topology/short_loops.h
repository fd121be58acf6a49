// Short disjoint loops that open all handles of a surface (thesis 5.4.1).
//
// Tree and cotree (Eppstein 2003; Erickson, Whittlesey 2005) over the free vertices: the tree has
// the shortest paths from a root, the cotree crosses edges by falling length of the cycle that they
// close in the tree. The edges that are left close cycles that are independent in homology, so any
// of them that are disjoint leave the surface connected when it is cut along them.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/topology/paths/canvas.h"

namespace flipfree::seamless {

// Draws `genus` loops through free vertices; returns the vertices of each in order. Precondition:
// nothing is drawn yet. Cost: O(#F log #F) a round; a round finds the shortest loop of its tree and
// those that are disjoint and not much longer.
std::vector<std::vector<VertexId>> draw_short_loops(Canvas& canvas, Index genus,
                                                    const ExecutionContext& context);

}  // namespace flipfree::seamless
