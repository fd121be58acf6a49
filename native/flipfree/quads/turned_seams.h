// Where the seams of a map lie that turn: quarter turns between cones are there to stay, but not
// along which edges.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree::quads {

// Moves seams so that those across which the map turns are shorter: a branch of them, between two
// vertices where others meet it or end, goes where another path does with less length that has no
// turn yet, as long as there is one. What lies between the two paths is turned and moved until the
// old one is no seam at all. Exact: UVs change by quarter turns and the seams' own translations;
// what stored values could not hold stays. The map is the same as a seamless one: same triangles,
// same cones, same isolines. A descent to paths of which no single one can be made shorter, not to
// the shortest of all. Precondition: seamless as stored. Cost: a search for shortest paths for
// every branch, some times. Throws Cancelled, TimeIsOver.
void shorten_turned_seams(certify::Parametrization& map, const ExecutionContext& context);

}  // namespace flipfree::quads
