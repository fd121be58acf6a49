// Quads made more regular: corners move over the surface.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/quads/places.h"
#include "flipfree/quads/quad_certificate.h"

namespace flipfree::quads {

// Moves every corner that is not `held` towards where its quads would have it, each being made a
// rectangle of nearly its own proportions: straight over the surface (slide()), so that it stays on
// it. A move that turns a corner of a quad against the surface there, that was not turned before,
// is halved, and in the end not made. Rounds: over all corners, in order. Throws Cancelled,
// TimeIsOver. Cost: O(rounds * #corners).
void relax(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
           const std::vector<Quad>& quads, const std::vector<char>& held, int rounds,
           std::vector<Spot>& spots, ExecutionContext& context);

}  // namespace flipfree::quads
