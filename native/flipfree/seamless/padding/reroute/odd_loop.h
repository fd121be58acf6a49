// Where all cones are even, whether a loop turns by an even or an odd number of quarters depends on
// its homology class alone: no way around cones changes it. Then the cut must be so from the start.
//
// Which loops are to turn by an odd number is told by one loop: those that cross it an odd number
// of times (Poincare duality mod 2). Drawn first, it makes a chain turn as it must
// (draw_twisted_chain()); along the other loops of the chain, disjoint from it, turns are even.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/seamless/padding/paths/canvas.h"
#include "flipfree/seamless/padding/reroute/branch_graph.h"
#include "flipfree/seamless/padding/reroute/loop_turns.h"

namespace flipfree::seamless {

// The branches that close a loop of homology_loops() along which the map is to turn by an odd
// number of quarters. Cost: as wished turns of that many loops.
std::vector<Index> odd_branches(const Canvas& canvas, const mesh::Adjacency& input_adjacency,
                                const BranchGraph& graph, const LoopTurning& turning);

// Erases the curves and draws one loop in their place that crosses these branches once each, and no
// other one; returns its vertices in order. Preconditions: the curves cut the canvas into one disk;
// divide_branches(); at least one branch. Cost: O(#F log #F) a branch.
std::vector<VertexId> draw_loop_across(Canvas& canvas, const BranchGraph& graph,
                                       const std::vector<Index>& branches,
                                       const ExecutionContext& context);

}  // namespace flipfree::seamless
