// G1: signed areas, decided exactly.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::certify {

// Faces whose corners (rows 3 f, 3 f + 1, 3 f + 2) do not turn strictly counter-clockwise, or have
// a coordinate that is not finite. Ascending.
std::vector<FaceId> flipped_faces(const Points2& corner_uv);
std::vector<FaceId> flipped_faces(const Points2f& corner_uv);

}  // namespace flipfree::certify
