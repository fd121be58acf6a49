// Is there a number inside? The degenerate case of thesis 3.5 (Figure 3.13), decided exactly.
//
// A vertex inside a ring of fixed vertices needs a grid point (pair of doubles, or of 32-bit
// floats) on the positive side of every ring edge. In each row of the grid the admissible values
// form an interval whose ends are found by bisection over the floating-point numbers with exact
// predicates; the rows are those between the ring's extremes, along the axis that has fewer.
#pragma once

#include <cstdint>
#include <string>

#include "flipfree/embedding/progressive/planar_map.h"
#include "flipfree/embedding/progressive/smoothing.h"

namespace flipfree::embedding {

struct Room {
  bool exact =
      false;  // all rows were looked at: `points` is the true number of admissible grid points
  std::uint64_t points = 0;  // number of admissible grid points in the rows looked at; saturates
  Vector2 middle =
      Vector2::Zero();  // one of them, in the middle of the widest row, if there is any
};

// Rows of the grid times corners that a proof that there is no room may look at.
inline constexpr std::uint64_t kRoomBudget = 1'000'000;

// `star.ring` and `star.at` give the ring, counter-clockwise. If there are more rows than `budget`
// / ring size, that many are sampled evenly. Cost: O(rows * ring * 64) predicates.
Room find_room(const PlanarMap& map, const Star& star, std::uint64_t budget = kRoomBudget);

// "between the edge (a, b) and vertex c": the narrowest extent of the ring.
std::string narrowest_extent(const Star& star);

}  // namespace flipfree::embedding
