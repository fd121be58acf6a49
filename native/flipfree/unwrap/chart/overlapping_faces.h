// Which triangles of a chart lie on top of each other in a map of it.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::unwrap {

struct FacePair {
  FaceId first = kInvalid, second = kInvalid;  // ascending
  double area = 0;                             // in common, rounded
};

// Pairs of triangles whose interiors meet, decided exactly; ascending. uv: #V x 2. Precondition:
// every triangle is positive. Cost: O(#F log #F + #pairs).
std::vector<FacePair> overlapping_faces(const Triangles& faces, const Points2& uv,
                                        const ExecutionContext& context);

}  // namespace flipfree::unwrap
