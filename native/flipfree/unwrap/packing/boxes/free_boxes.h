// The room that obstacles leave in the unit square, as boxes.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::unwrap {

struct FreeBox {
  Vector2 low;
  Vector2 size;
};

// Disjoint boxes in [0, 1 - margin]^2, largest first, of which no point has an obstacle within
// `margin` to its right and above: rectangles that bring a margin of their own on their left and
// lower sides keep it everywhere. Obstacles (3 k x 2: triangles of either orientation, finite) are
// drawn into 256 x 256 cells, each cell that one touches counts as taken; crumbs are left out.
// Cost: O(#cells touched by obstacles + #boxes #cells), at most 64 boxes.
std::vector<FreeBox> free_boxes(const Points2& obstacles, const Vector2& tile, double margin);

}  // namespace flipfree::unwrap
