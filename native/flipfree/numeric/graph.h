// Graphs as arrays, for elimination orders.
#pragma once

#include <cstddef>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::numeric {

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

}  // namespace flipfree::numeric
