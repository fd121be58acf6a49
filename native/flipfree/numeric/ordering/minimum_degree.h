// Elimination order of a graph of at most 64 vertices by minimum degree, on sets of 64 bits.
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::numeric {

inline constexpr Index kMinimumDegreeLimit = 64;

// near[v]: set of the neighbours of v, without v. outside[v]: neighbours beyond this graph that are
// eliminated later; they count as far as the input names them. Returns the local order.
std::vector<Index> minimum_degree(std::vector<std::uint64_t>& near,
                                  const std::vector<Index>& outside);

}  // namespace flipfree::numeric
