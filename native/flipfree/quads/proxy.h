// Quads of a surface of many triangles, made on few of them: the way back.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/quads/places.h"
#include "flipfree/quads/quad_certificate.h"

namespace flipfree::quads {

struct BroughtBack {
  std::vector<Spot> spots;          // of the corners, on the whole surface
  std::vector<FaceId> quad_parent;  // of it, per quad
};

// Quads of a decimated surface, with their corners at `places`, as some of `whole`: corners go to
// the nearest points of it, those on the border to the nearest ones of that, and are relaxed, but
// for those on border and `features`. Throws Cancelled, TimeIsOver. Cost: O(#F log #F).
BroughtBack bring_back(const mesh::Surface& whole, const IndexPairs& features,
                       const std::vector<Quad>& quads, const Points3& places,
                       ExecutionContext& context);

}  // namespace flipfree::quads
