// Opens a map that only touches itself.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::unwrap {

// Copies of a vertex that lie in the same place, but for rounding, are drawn into the corners of
// their own faces, no further than 32-bit floats need to see it where that is enough, until the
// piece does not touch itself; uv: #V x 2, flip-free. False if it still does, and nothing is
// changed. Cost: O(n log n).
bool draw_apart(const Triangles& faces, Points2& uv, const ExecutionContext& context);

}  // namespace flipfree::unwrap
