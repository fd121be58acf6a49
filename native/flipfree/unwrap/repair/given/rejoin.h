// Corners that were torn off a map, joined to it again.
#pragma once

#include <vector>

#include "flipfree/mesh/cut.h"

namespace flipfree::unwrap {

// A place that only faces have which are flipped, collapsed, or drawn out more than 4 times as far
// as the map's median, becomes the next one's around its vertex, not across an edge of `seams` (may
// be empty), if that makes all of these faces as good as others. Corners with a flag in `fixed`
// (3 #F, may be empty) stay. uv: 3 #F x 2, finite. Returns how many corners were joined. Cost: O(#F
// log #F).
Index rejoin_torn(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                  const mesh::EdgeFlags& seams, const std::vector<char>& fixed, Points2& uv);

}  // namespace flipfree::unwrap
