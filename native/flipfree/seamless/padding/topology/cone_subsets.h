// Cones whose excess sums to a given number (thesis 5.3.3).
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::seamless {

// Vertices with cones (k other than 4) whose k - 4 sum to `excess`, by dynamic programming; nothing
// if there are none. `cones`: #V, quarter turns. excess: not zero. Cost: O(number of cones * range
// of their sums).
std::optional<std::vector<VertexId>> cones_with_excess(const std::vector<Index>& cones,
                                                       Index excess);

}  // namespace flipfree::seamless
