// How much a map is stretched, as automatic seams bound it.
#pragma once

#include <vector>

#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/seam_options.h"

namespace flipfree::unwrap {

// Infinite where a face is flipped or degenerate. corner_uv: 3 #F x 2. Cost: O(#F).
Stretch stretch_of(const mesh::Surface& surface, const Points2& corner_uv);

// Per face, by how much its lengths or its area change, up or down, whichever is most; 1 where the
// map has no energy. Cost: O(#F).
std::vector<double> ratios_of(const mesh::Surface& surface, const Points2& corner_uv);

}  // namespace flipfree::unwrap
