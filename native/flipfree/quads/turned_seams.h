// Where the seams of a map lie that turn: quarter turns between cones are there to stay, but not
// along which edges.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree::quads {

// Moves seams so that those across which the map turns are shorter: a branch of them, between two
// vertices where others meet it or end, goes along the path with the least length that has no turn
// yet, if it is shorter so and the two paths part the surface. What lies between them is turned and
// moved until the old one is no seam at all. Exact: UVs change by quarter turns and the seams' own
// translations; what stored values could not hold stays. The map is the same as a seamless one:
// same triangles, same cones, same isolines. A descent by single branches, not to the shortest
// seams of all; branches round handles stay. A map that is not seamless in 64 bits stays as it is,
// for its certificate to say so. Cost: a search for shortest paths, no longer than the branch, for
// every branch, some times. Throws Cancelled, TimeIsOver.
void shorten_turned_seams(certify::Parametrization& map, const ExecutionContext& context);

}  // namespace flipfree::quads
