// Do different charts cover a common piece of the plane? Decided exactly.
#pragma once

#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::certify {

struct IslandOverlaps {
  std::int64_t pairs = 0;     // pairs of charts that share area; counting ends at kMostPairs
  std::vector<FaceId> faces;  // one face of either chart per pair, ascending, at most 1000
  static constexpr std::int64_t kMostPairs = 1'000'000;
};

// Two charts share area exactly if the interiors of two of their triangles meet; charts that touch
// along edges or in points do not. Flipped triangles cover what they cover; degenerate ones and
// those with a coordinate that is not finite cover nothing. Cost: O(#charts log #charts) for charts
// whose bounding boxes are apart; else O(#F log #F) for the trees of those that are not, and the
// descent into them, which ends at a pair's first two triangles.
IslandOverlaps island_overlaps(const mesh::Components& charts, const Points2& corner_uv);

}  // namespace flipfree::certify
