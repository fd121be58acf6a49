// Slits of a large chart: found on few of its vertices, and carried back.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/seams/search/search.h"

namespace flipfree::unwrap {

// As find_slits(). The chart is decimated, slits are found there, and every one becomes a shortest
// path of the chart through the neighbourhood of what went into the vertices along it. The chart's
// own map (level_map.h) is what is judged: above the bound, the search goes on with a lower one.
// Empty where the slits cannot be carried back or time was over before any were found.
Slits carried_slits(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                    const std::vector<double>& cost, const SlitOptions& options,
                    ExecutionContext& context);

}  // namespace flipfree::unwrap
