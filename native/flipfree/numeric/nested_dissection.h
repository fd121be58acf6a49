// Fill-reducing elimination order by nested dissection of our own: unlike a library call it can be
// cancelled, and it uses all threads.
//
// A part of the graph is split by a small separator that is eliminated last; its two sides
// recursively (George 1973). Separators are the cheapest cuts along breadth-first distances from
// one end of the part, and along the difference of those from both. Parts of up to 64 vertices are
// ordered by minimum degree.
#pragma once

#include <cstddef>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::numeric {
// Graphs as arrays, for elimination orders.

// Symmetric graph without loops: neighbours of v are neighbour[offset[v] .. offset[v + 1]).
struct Graph {
  std::vector<Index> offset;  // count + 1
  std::vector<Index> neighbour;
  Index count() const { return static_cast<Index>(offset.size()) - 1; }
};

template <typename Visit>
void for_neighbours(const Graph& graph, Index v, Visit visit) {
  const auto at = static_cast<std::size_t>(v);
  for (Index i = graph.offset[at]; i < graph.offset[at + 1]; ++i)
    visit(graph.neighbour[static_cast<std::size_t>(i)]);
}

// Elimination position -> vertex. Hubs, vertices with very many neighbours beside others with few,
// as the translations of a seamless map are, come last. Cost: O(n log n). Checks for cancel. The
// same order for any number of threads.
std::vector<Index> nested_dissection(const Graph& graph, const ExecutionContext& context);

}  // namespace flipfree::numeric
