// How much a map is stretched, as automatic seams bound it.
#pragma once

#include <limits>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/seam_options.h"

namespace flipfree::unwrap {

// No bound; and how much a map is stretched that has a flipped or degenerate face.
inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Infinite where a face is flipped or degenerate. corner_uv: 3 #F x 2. Cost: O(#F).
Stretch stretch_of(const mesh::Surface& surface, const Points2& corner_uv);

// Per face, by how much its lengths or its area change, up or down, whichever is most; 1 where the
// map has no energy. Cost: O(#F).
std::vector<double> ratios_of(const mesh::Surface& surface, const Points2& corner_uv);

// The map (#V x 2) with the triangles that are stretched most eased at the expense of the others,
// so that it is within `most`; the map as it was where that is not reached. Where its energy is
// above the bound, or its ratio far above, it is not tried. apart: it does not lie on itself, and
// shall not. The surface's own scale is kept. Cost: some ten Newton steps.
Points2 eased(const mesh::Surface& chart, const Points2& uv, const Stretch& most, bool apart,
              ExecutionContext& context);

}  // namespace flipfree::unwrap
