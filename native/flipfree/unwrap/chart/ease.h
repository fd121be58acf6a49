// Maps whose mean is within a bound, but not their most stretched places.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/seam_options.h"

namespace flipfree::unwrap {

// The map (#V x 2) with the triangles that are stretched most eased at the expense of the others,
// so that it is within `most`; the map as it was where that is not reached. Where its energy is
// above the bound, or its ratio far above, it is not tried. apart: it does not lie on itself, and
// shall not. The surface's own scale is kept. Cost: some ten Newton steps.
Points2 eased(const mesh::Surface& chart, const Points2& uv, const Stretch& most, bool apart,
              ExecutionContext& context);

}  // namespace flipfree::unwrap
