// Whether a triangle in space has an area at all, decided exactly.
#pragma once

#include "flipfree/base/types.h"

namespace flipfree::mesh {

// False if the three corners are exactly collinear, or two of them equal. Precondition: finite
// coordinates, valid indices.
bool has_area(const Points3& positions, const Triangles& faces, FaceId f);

}  // namespace flipfree::mesh
