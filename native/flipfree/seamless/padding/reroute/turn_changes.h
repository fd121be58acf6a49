// Which cones a curve must be taken around so that it turns by so much more (thesis 6.5.3.2).
#pragma once

#include <set>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::seamless {

// A curve taken around a cone turns by its excess k - 4 more, or less: on the side that one wants.
// The greatest common divisor of all, 0 if there are none: turns change by its multiples.
// `cones`: quarter turns per vertex.
Index least_change(const std::vector<Index>& cones);

// Of the shortest sums of such changes, the same cone as often as it takes, that make `wanted`: all
// that one may begin with. So taking one after the other ends. Breadth first over the sums.
// Precondition: least_change() divides `wanted`, which is not 0. Cost: O((wanted + largest excess)
// * number of different ones).
std::set<Index> next_changes(const std::vector<Index>& cones, Index wanted);

}  // namespace flipfree::seamless
