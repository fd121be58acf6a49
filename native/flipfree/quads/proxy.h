// Other triangles to make quads on: more of them where the surface's are longer than quads are, and
// of a surface of many triangles few, with the way back.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/quads/places.h"
#include "flipfree/quads/quad_certificate.h"

namespace flipfree::quads {

struct DividedSurface {
  mesh::Surface surface;  // the input's vertices first
  mesh::Provenance provenance;
  IndexPairs features;            // the input's that lie inside, in pieces
  std::vector<HalfedgeId> whole;  // of the input, per piece: one of the edge that it is of
};

// The surface with vertices on the middles of its edges, the longest first, until none is longer
// than `longest`: a field has no room for cones, and a map none to bend, on long faces between
// features. A face without neighbours gets them on all sides: a map needs a fourth corner. Faces
// that are lines but for rounding offer none. At most `most` times. Throws Cancelled, TimeIsOver.
// Cost: O(#F log #F).
DividedSurface divided(const mesh::Surface& surface, const IndexPairs& features, double longest,
                       std::size_t most, const ExecutionContext& context);

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
