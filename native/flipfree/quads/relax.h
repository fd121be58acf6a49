// Quads made more regular: corners move over the surface.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/quads/places.h"
#include "flipfree/quads/quad_certificate.h"

namespace flipfree::quads {

// How a corner moves: over the surface, along the lines that it lies on, or not at all.
enum class Freedom : char { kFree, kAlongLine, kHeld };

// Per spot: does it lie on one of these edges (flags of half-edges), but for rounding?
std::vector<char> on_lines(const mesh::Surface& surface, const mesh::EdgeFlags& lines,
                           const std::vector<Spot>& spots);

// Moves every corner as its freedom allows towards where its quads would have it, each being made a
// rectangle of nearly its own proportions: straight over the surface (slide()), so that it stays on
// it; or along `lines` (flags of half-edges: borders, features), past vertices at which two edges
// of them meet. A move that turns a corner of a quad against the surface there, that was not turned
// before, is halved, and in the end not made. Rounds: over all corners, in order; then, if there
// are any, free corners go to the surface's vertices that lie farthest from the quads, by more than
// a share of a side, and stay there. Throws Cancelled, TimeIsOver. Cost: O(rounds * #corners), and
// about one search of the nearest quad per vertex.
void relax(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
           const std::vector<Quad>& quads, const mesh::EdgeFlags& lines,
           const std::vector<Freedom>& freedom, int rounds, std::vector<Spot>& spots,
           ExecutionContext& context);

}  // namespace flipfree::quads
