// From a map of a decimated surface to one of the whole surface.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/decimated/decimated.h"

namespace flipfree::mesh {

// whole: what was decimated. uv: #V of few.surface x 2, flip-free, at the surface's unit. The map
// of all vertices, flip-free by exact test. keep_boundary: its boundary is the same curve but for
// rounding wherever a vertex can stand on it; otherwise it leaves the curve where stars would be
// drawn out. Empty where 64 bits are too coarse for it. Cost: O(#V).
Points2 prolong(const Surface& whole, const Decimated& few, const Points2& uv, bool keep_boundary,
                const ExecutionContext& context);

}  // namespace flipfree::mesh
