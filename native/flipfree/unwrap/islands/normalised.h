// The unit in which an unwrap works.
#pragma once

#include "flipfree/base/types.h"

namespace flipfree::unwrap {

// Positions scaled by one power of two, which is exact, so that squares neither overflow nor vanish
// whatever the user's unit is; every component is moved to the origin on its own, so that none of
// them is lost beside one that is large or far away.
// Cost: O(#V + #F).
Points3 normalised(const Points3& positions, const Triangles& faces);

}  // namespace flipfree::unwrap
