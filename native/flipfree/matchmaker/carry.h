// Carries a map along when the triangulated polygon under it changes shape.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/refined_surface.h"
#include "flipfree/matchmaker/target_domain.h"

namespace flipfree {

// The triangle of the domain that holds b at shape `place`, found along the segment a -> b from
// face f, which holds a, or, if `corner` is given, from that domain vertex, which lies at a.
// kInvalid if the segment leaves the domain. Cost: O(triangles crossed).
FaceId find_along(const TargetDomain& domain, const std::vector<Vector2>& place, FaceId f,
                  Index corner, const Vector2& a, const Vector2& b);

// Every vertex of the map lies in a triangle of the domain at shape `from`; the result has it at
// the same place of that triangle at shape `to` (both: a point per domain vertex). The domain may
// overlap itself: triangles are found along mesh edges, starting from the boundary, which stay
// within the disk. A guess for where a map goes, without guarantee: long edges may cross after it.
// Preconditions: uv is flip-free, its boundary vertices are at `from`; the domain has no inner
// vertices. Cost: O(#E + domain edges crossed by a spanning tree of mesh edges).
Points2 carry(const RefinedSurface& surface, const Points2& uv, const TargetDomain& domain,
              const std::vector<Vector2>& from, const std::vector<Vector2>& to,
              const ExecutionContext& context);

}  // namespace flipfree
