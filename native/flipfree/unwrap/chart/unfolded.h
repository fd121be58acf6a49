// A chart laid flat triangle by triangle.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// Each triangle with its own shape, joined to the one before it, breadth first: isometric but for
// rounding where the chart is developable, and torn out of shape where it is not, so that triangles
// may flip. Empty if not all vertices are reached. Cost: O(#V + #F).
Points2 unfolded(const mesh::Surface& chart, const ExecutionContext& context);

}  // namespace flipfree::unwrap
