// How much a map is stretched, as automatic seams bound it.
#pragma once

#include <limits>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/options.h"

namespace flipfree::unwrap {

// No bound; and how much a map is stretched that has a flipped or degenerate face.
inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Infinite where a face is flipped or degenerate. corner_uv: 3 #F x 2. Cost: O(#F).
Stretch stretch_of(const mesh::Surface& surface, const Points2& corner_uv);

}  // namespace flipfree::unwrap
