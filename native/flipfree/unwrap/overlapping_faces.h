// Which triangles of a chart lie on top of each other in a map of it.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree {

using FacePair = std::array<FaceId, 2>;  // ascending

// Pairs of triangles whose interiors meet, exactly; ascending. uv: #V x 2. Precondition: every
// triangle is positive. Cost: O(#F log #F + #pairs).
std::vector<FacePair> overlapping_faces(const Triangles& faces, const Points2& uv,
                                        const ExecutionContext& context);

}  // namespace flipfree
