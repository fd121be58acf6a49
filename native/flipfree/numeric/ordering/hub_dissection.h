// Nested dissection of graphs that may have hubs: vertices with very many neighbours, as the
// translations of a seamless map are, beside others with few.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/numeric/ordering/graph.h"
#include "flipfree/numeric/ordering/tree_node.h"

namespace flipfree::numeric {

// As nested_dissection().
std::vector<Index> hub_dissection(const Graph& graph, const double* places,
                                  const ExecutionContext& context, DissectionTree& tree);

}  // namespace flipfree::numeric
