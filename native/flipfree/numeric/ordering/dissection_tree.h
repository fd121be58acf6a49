// The tree behind an order by nested dissection, and its repair after a few edges of the graph
// changed.
//
// A node of the tree is a part of the graph; its own vertices are its separator (or all of it, at a
// leaf), and the order is the postorder of the tree: left side, right side, separator. The order is
// good as long as no edge joins vertices of nodes on different branches. A flip joins two vertices
// that were two steps apart, which rarely lie on different branches; where they do, one of them
// moves up to the lowest common node, and vertices that no longer hold two sides apart sink.
// Everything else stays, so a repair costs a few sweeps over the graph where a new order searches
// every separator again.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/numeric/ordering/graph.h"
#include "flipfree/numeric/ordering/tree_node.h"

namespace flipfree::numeric {

// Moves vertices until every edge of `graph` lies on one branch, and returns the order: elimination
// position -> vertex. Vertices of one node keep the order they had in `before`, those of leaves are
// ordered anew; leaves that have grown too large are split. Deterministic. Cost: O(n log n) with
// small constants.
std::vector<Index> repair_dissection(const Graph& graph, const std::vector<Index>& before,
                                     DissectionTree& tree, const ExecutionContext& context);

}  // namespace flipfree::numeric
