// Fill-reducing elimination order by nested dissection of our own: unlike a library call it can be
// cancelled, it uses all threads, and where a planar drawing is known it need not search for one.
//
// A part of the graph is split by a small separator that is eliminated last; its two sides
// recursively. Separators come from sweeping several keys over the part - the drawing's coordinates
// and diagonals, and breadth-first distances, which do not care how distorted the drawing is -,
// taking the cheapest cut, and refining it with vertex moves (Fiduccia, Mattheyses 1982; in the
// form for vertex separators of Hendrickson, Rothberg 1998). Parts of up to 64 vertices are ordered
// by minimum degree.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/numeric/ordering/graph.h"
#include "flipfree/numeric/ordering/tree_node.h"

namespace flipfree::numeric {

// Elimination position -> vertex. places: null, or x and y per vertex; any finite values are
// correct, a good drawing is faster. tree: null, or receives the node of every vertex. Cost:
// O(n log n). Checks for cancel. The same order for any number of threads.
std::vector<Index> nested_dissection(const Graph& graph, const double* places,
                                     const ExecutionContext& context,
                                     DissectionTree* tree = nullptr);

}  // namespace flipfree::numeric
