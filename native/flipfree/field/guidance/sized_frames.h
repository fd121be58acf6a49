// Fields for maps that are larger in some places than in others.
//
// Scaled by e^p, p varying, a map that follows a field has the field turn by *dp (thesis 6.3: a
// conformal change of the metric moves curvature, -laplace p, and with it where cones cost least).
// So the smoothest field for it is the one with the least rotation on the scaled surface.
#pragma once

#include <vector>

#include "flipfree/field/topology/cross_field.h"

namespace flipfree::field {

// One positive number per vertex, or none at all. Throws InvalidInput (kBadShape, kBadOption)
// naming the vertex.
void check_sizing(const std::vector<double>& sizing, const mesh::Surface& surface);

// The frames in which the field that the scaled surface is parallel in does not turn: directions
// of half-edges change by what the corners opposite of them say, corners stay. `sizing`: per
// vertex, positive; length in the map of a length 1 there. Cost: O(#F).
Frames sized_frames(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                    const Frames& frames, const std::vector<double>& sizing);

}  // namespace flipfree::field
