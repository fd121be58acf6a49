// The room that obstacles leave in the unit square, as boxes.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::unwrap {

struct FreeBox {
  Vector2 low;
  Vector2 size;
};

// Rectangles into a unit tile, at one scale, clear of what lies there already.

struct RoomOptions {
  // Least space between rectangles, to obstacles and to the tile's border, in units of the tile.
  // Lowered to 0.9 / (ceil(sqrt(n)) + 1) for n rectangles, so that they have room, and never less
  // than 2^-17: 32-bit rounding and its repairs stay within.
  double margin = 0.005;
  // 3 k x 2, k triangles of either orientation, degenerate ones too, finite; or null.
  const Points2* obstacles = nullptr;
  // Factor on the sizes that is wanted: taken if everything fits, else the largest found that does.
  // 0: the largest.
  double scale = 0.0;
  Index first_tile = 0;  // where the search for one with room begins
};

// Unit tiles that UDIM has.
inline constexpr Index kTiles = 100;

// Lower left corner of a unit tile: column + 10 row, as UDIM counts (less 1001).
Vector2 tile_corner(Index tile);

// The margin that so many rectangles get for one that is wanted (RoomOptions).
double fitting_margin(double margin, std::size_t count);

struct Placement {
  std::vector<Vector2> corner;  // lower left, per rectangle, once scaled
  double scale = 1.0;           // the common factor
  Index tile = 0;               // column + 10 row of the unit tile, as UDIM counts (less 1001)
};

// Skylines in the largest free boxes, at the largest scale that bisection finds over a few orders
// of the rectangles (one for more than 2000). A tile counts as full if it allows less than an
// eighth of the scale that an empty one allows (or of the scale that is wanted, if that is less);
// then the next is tried, in the order of UDIM. Deterministic. Throws InvalidInput (kBadOption) if
// all 100 are full. Cost: O(n s) for skylines of s steps, about sqrt(n), per scale tried, some 30
// per order.
Placement pack_rectangles(const std::vector<Vector2>& sizes, const RoomOptions& options);

}  // namespace flipfree::unwrap
